// SPDX-License-Identifier: Apache-2.0
// Procedures of EncoLink; positions continue during register accesses.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/protocol/encolink/host.hpp"
#include "absenc/protocol/encolink/registers.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

/// Interface by which procedures send requests and await replies.
using Dialog = author::DialogOf<Frames>;

/// How a register access ended.
enum class AccessOutcome : std::uint8_t {
  good,     ///< The encoder executed the access.
  refused,  ///< The encoder refused the access, or was busy with it for longer than `busy_limit`.
  lost,     ///< Frames arrive, but no valid answer; the access may have been executed.
  gone,     ///< No valid frames arrive; `was_sent` tells whether the encoder may have executed the access.
};

/// State of a procedure together with its results.
struct ProcedureState : Channels {
  /// Value of a register of the table.
  struct Value {
    std::size_t index;                   ///< Index of the register in the table.
    ByteBuffer<largest_register> bytes;  ///< Bytes of the register, most significant first.
  };
  /// Identity of the encoder; reported instead of the position, together with `values`.
  std::optional<Identity> identity{};
  /// Address of the register whose bytes are in `data`; reported instead of the position.
  std::optional<std::uint32_t> address{};
  Buffer<Value, 8> values{};      ///< Values of registers of the table that were read or written.
  std::optional<bool> running{};  ///< Whether a self-calibration is running; no value in other procedures.
  bool reports_status = false;    ///< Whether the detailed status is reported.

  bool emits = false;                 ///< Whether each position is emitted before the next request.
  bool is_new = false;                ///< Whether the latest position was not emitted yet.
  std::uint8_t protocol_version = 0;  ///< Protocol version in the identity; 0: the identity was not read yet.
  unsigned lost = 0;                  ///< Number of frames in a row that were lost or damaged.
  AccessBytes access{};               ///< All `ra` bytes of the present register access.
  bool writes = false;                ///< Whether the present register access is a write.
  /// Whether all `ra` bytes were sent, so that the encoder may have executed the access.
  bool was_sent = false;
  bool changed = false;                ///< Whether a register was written and read back.
  std::uint16_t length = 0;            ///< Number of data bytes of the present register access.
  ByteBuffer<access_capacity> data{};  ///< Bytes that the present register access has read.
  author::Outcome why{};               ///< Error and explanation of the last attempt of a register access.
  bool again = false;                  ///< Whether repeating the register access can help and does no harm.

  /// Stores `request` as the present register access.
  void begin(const RegisterRequest& request) {
    access = encode_access(request);
    writes = request.operation == RegisterRequest::Operation::write;
    length = request.length;
  }
  /// Stores error and explanation of a register access and returns how it ended.
  AccessOutcome end(AccessOutcome access_outcome, const author::Outcome& outcome, bool can_help = false) {
    why = outcome;
    again = can_help;
    return access_outcome;
  }
  /// Adds the value `bytes` of register `index` to the results.
  void add_value(std::size_t index, Bytes bytes) {
    values.push_back({index, {}});
    values[values.size() - 1].bytes.append(bytes);
  }
};

/// Reads `size` bytes at `address`, in up to five attempts. Returns how the last one ended.
author::Part<AccessOutcome> attempt_read(Dialog& dialog, ProcedureState& found, std::uint32_t address,
                                         std::uint16_t size);
/// Writes `value` as `size` bytes to `address`; repeats no write that may have been executed.
author::Part<AccessOutcome> attempt_write(Dialog& dialog, ProcedureState& found, std::uint32_t address,
                                          std::uint16_t size, std::uint64_t value);

/// Reads a cycle of channel 2 for its alarms, and compares the positions of channels 1 and 2.
author::Procedure read_alarms(Dialog& dialog, ProcedureState& found);
/// Reads the identity of the encoder.
author::Procedure read_identity(Dialog& dialog, ProcedureState& found);
/// Reads the identity and every register that has `in_info`, as far as the encoder permits.
author::Procedure read_info(Dialog& dialog, ProcedureState& found);

/// Reads register `index` of the table.
author::Procedure read_register(Dialog& dialog, ProcedureState& found, std::size_t index);
/// Reads a register. Arguments: address, length (0: from the table).
author::Procedure read_memory(Dialog& dialog, ProcedureState& found, Arguments arguments);

/// Writes register `index` of the table, and reads it back.
author::Procedure write_register(Dialog& dialog, ProcedureState& found, std::size_t index, Arguments arguments);
/// Writes a register, and reads it back. Arguments: address, value, size (0: from the table).
author::Procedure write_memory(Dialog& dialog, ProcedureState& found, Arguments arguments);
/// Writes `command` to the command register; a write that may have been executed is not repeated.
author::Procedure send_command(Dialog& dialog, ProcedureState& found, std::uint8_t command);

/// Makes the present position the zero of the turn. Argument: 1 to save the position offset.
author::Procedure zero(Dialog& dialog, ProcedureState& found, Arguments arguments);
/// Sets the turn counter. Arguments: turns, 1 to save them.
author::Procedure preset_multiturn(Dialog& dialog, ProcedureState& found, Arguments arguments);
/// Starts the self-calibration, and emits its status while the user turns the shaft.
author::Procedure self_calibrate(Dialog& dialog, ProcedureState& found);

/// Returns `wanted`; if that is 0, the size of the register in the table, 0 if it has none.
[[nodiscard]] std::uint16_t register_size(std::uint32_t address, std::int64_t wanted);

}  // namespace absenc::encolink
