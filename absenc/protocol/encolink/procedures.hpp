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

/// How an attempt of a register access ended.
enum class AccessOutcome : std::uint8_t {
  good,     ///< The encoder executed the access.
  refused,  ///< The encoder refused the access, or was busy with it for longer than `busy_limit`.
  lost,     ///< Valid frames arrive, but no valid answer to the access; the encoder may have executed it.
  gone,     ///< Valid frames no longer arrive; `was_sent` tells whether the encoder may have executed the access.
};

/// State of a procedure, with its results.
struct ProcedureState : Channels {
  /// Value of a register of the table `registers`.
  struct Value {
    std::size_t index;                   ///< Index of the register in the table `registers`.
    ByteBuffer<largest_register> bytes;  ///< Bytes of the register, most significant first.
  };
  /// Identity of the encoder. If it has a value, the procedure reports it with `values` instead of the position.
  std::optional<Identity> identity{};
  /// Address of the register whose bytes are in `data`. If it has a value, the procedure reports it instead of the
  /// position.
  std::optional<std::uint32_t> address{};
  /// Values of the registers that the procedure has read or written, if they are in the table.
  Buffer<Value, 8> values{};
  std::optional<bool> running{};  ///< Whether a self-calibration is running; no value in other procedures.
  bool reports_status = false;    ///< Whether the procedure reports the detailed status.

  bool emits = false;                 ///< Whether the procedure emits each position before the next request.
  bool is_new = false;                ///< Whether the latest position was not emitted or reported yet.
  std::uint8_t protocol_version = 0;  ///< Protocol version in the identity; 0: the identity was not read yet.
  unsigned lost = 0;                  ///< Number of frames in a row that were lost or damaged.
  AccessBytes access{};  ///< Bytes of the present register access, in the order in which requests carry them.
  bool writes = false;   ///< Whether the present register access is a write.
  /// Whether all bytes of the register access were sent, so that the encoder may have executed it.
  bool was_sent = false;
  bool changed = false;                ///< Whether the procedure has written a register and read it back.
  std::uint16_t length = 0;            ///< Number of data bytes of the present register access.
  ByteBuffer<access_capacity> data{};  ///< Data bytes that the present register access has read.
  author::Outcome why{};               ///< Error of the last attempt of a register access, with its explanation.
  bool again = false;                  ///< Whether a repetition of the register access may succeed and does no harm.

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
  /// Adds `bytes`, the value of the register with this index in the table `registers`, to the results.
  void add_value(std::size_t index, Bytes bytes) {
    values.push_back({index, {}});
    values[values.size() - 1].bytes.append(bytes);
  }
};

/// Reads `size` bytes at `address`, in up to five attempts. Returns how the last attempt ended.
author::Part<AccessOutcome> attempt_read(Dialog& dialog, ProcedureState& found, std::uint32_t address,
                                         std::uint16_t size);
/// Writes `value` as `size` bytes to `address`. A write that may have been executed is not repeated.
author::Part<AccessOutcome> attempt_write(Dialog& dialog, ProcedureState& found, std::uint32_t address,
                                          std::uint16_t size, std::uint64_t value);

/// Reads a cycle of channel 2 for its alarms, and compares the positions of channels 1 and 2.
author::Procedure read_alarms(Dialog& dialog, ProcedureState& found);
/// Reads the identity of the encoder.
author::Procedure read_identity(Dialog& dialog, ProcedureState& found);
/// Reads the identity and every register with `in_info` in the table; skips registers that the encoder refuses.
author::Procedure read_info(Dialog& dialog, ProcedureState& found);

/// Reads the register with this index in the table `registers`.
author::Procedure read_register(Dialog& dialog, ProcedureState& found, std::size_t index);
/// Reads a register. Arguments: address, length in bytes (0: that of the table).
author::Procedure read_memory(Dialog& dialog, ProcedureState& found, Arguments arguments);

/// Writes the register with this index in the table `registers`, and reads it back.
author::Procedure write_register(Dialog& dialog, ProcedureState& found, std::size_t index, Arguments arguments);
/// Writes a register, and reads it back. Arguments: address, value, size in bytes (0: that of the table).
author::Procedure write_memory(Dialog& dialog, ProcedureState& found, Arguments arguments);
/// Writes `command` to the command register; a write that may have been executed is not repeated.
author::Procedure send_command(Dialog& dialog, ProcedureState& found, std::uint8_t command);

/// Makes the present position the zero of the turn. Argument: 1 to save the position offset.
author::Procedure zero(Dialog& dialog, ProcedureState& found, Arguments arguments);
/// Sets the turn counter. Arguments: turns; 1 to save the preset, 0 otherwise.
author::Procedure preset_multiturn(Dialog& dialog, ProcedureState& found, Arguments arguments);
/// Starts the self-calibration, and emits its status while the user turns the shaft.
author::Procedure self_calibrate(Dialog& dialog, ProcedureState& found);

/// Returns `wanted`, a number of bytes. If `wanted` is 0, returns the size in bytes of the register at `address`, or 0
/// if the table `registers` has no such register.
[[nodiscard]] std::uint16_t register_size(std::uint32_t address, std::int64_t wanted);

}  // namespace absenc::encolink
