// SPDX-License-Identifier: Apache-2.0
// The procedures of EncoLink. Positions continue during register accesses; most procedures emit each position.
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
  good,     ///< the encoder executed the access
  refused,  ///< the encoder did not execute the access
  lost,     ///< frames arrive, but the answer does not: the access may have been executed
  gone,     ///< no frames arrive; `was_sent` tells whether the access may have been executed
};

/// State of a procedure and its results. Without other results the position is reported.
struct ProcedureState : Channels {
  /// Value of a register.
  struct Value {
    std::size_t index;                   ///< index of the register in the table
    ByteBuffer<largest_register> bytes;  ///< Bytes of the register, most significant first.
  };
  std::optional<Identity> identity{};  ///< reported instead of the position, together with `values`
  /// Address of the register whose bytes are `data`; reported instead of the position.
  std::optional<std::uint32_t> address{};
  Buffer<Value, 8> values{};      ///< values of registers of the table
  std::optional<bool> running{};  ///< whether a self-calibration is running
  bool reports_status = false;    ///< Whether the fields show the status.

  bool emits = false;                  ///< each position is emitted
  bool is_new = false;                 ///< the latest position was not emitted yet
  std::uint8_t protocol_version = 0;   ///< version in the identity; 0: the identity was not read yet
  unsigned lost = 0;                   ///< number of lost frames in a row
  AccessBytes access{};                ///< all `ra` bytes of the present register access
  bool writes = false;                 ///< the present access is a write
  bool was_sent = false;               ///< all `ra` bytes were sent: the encoder may have executed the access
  bool changed = false;                ///< a register was written and read back
  std::uint16_t length = 0;            ///< bytes that the access reads
  ByteBuffer<access_capacity> data{};  ///< bytes that the access has read
  author::Outcome why{};               ///< why the access failed
  bool again = false;                  ///< a repetition of the access can help and does no harm

  /// Begins a register access.
  void begin(const RegisterRequest& request) {
    access = encode_access(request);
    writes = request.operation == RegisterRequest::Operation::write;
    length = request.length;
  }
  /// Stores the outcome of an access and returns it.
  AccessOutcome end(AccessOutcome access_outcome, const author::Outcome& outcome, bool can_help = false) {
    why = outcome;
    again = can_help;
    return access_outcome;
  }
  /// Adds the value of a register to the results.
  void add_value(std::size_t index, Bytes bytes) {
    values.push_back({index, {}});
    values[values.size() - 1].bytes.append(bytes);
  }
};

/// Executes one register access while positions continue. Stops the procedure if the encoder has no registers, or those
/// of an AksIM-4.
author::Part<AccessOutcome> attempt_read(Dialog& dialog, ProcedureState& found, std::uint32_t address,
                                         std::uint16_t size);
/// Tries to write a register.
author::Part<AccessOutcome> attempt_write(Dialog& dialog, ProcedureState& found, std::uint32_t address,
                                          std::uint16_t size, std::uint64_t value);

/// Reads a cycle of channel 2 and compares it with channel 1.
author::Procedure read_alarms(Dialog& dialog, ProcedureState& found);
/// Reads the identity.
author::Procedure read_identity(Dialog& dialog, ProcedureState& found);
/// Reads the identity and every register with `in_info`. Leaves out registers that the encoder rejects.
author::Procedure read_info(Dialog& dialog, ProcedureState& found);

/// Reads register `index` of the table. Errors of this and the following procedures: request_rejected (the detail
/// explains the encoder's status), busy, timeout, cross_check_failed (channel 2 disagrees with channel 1), unsupported
/// (no channel 2, or other registers), or the error of a frame.
author::Procedure read_register(Dialog& dialog, ProcedureState& found, std::size_t index);
/// Reads a register. Arguments: address, length (0: from the table). Error also: invalid_argument (a length is needed).
author::Procedure read_memory(Dialog& dialog, ProcedureState& found, Arguments arguments);

/// Writes register `index` of the table. This and the following procedures also have the error cross_check_failed
/// (reading back gave another value).
author::Procedure write_register(Dialog& dialog, ProcedureState& found, std::size_t index, Arguments arguments);
/// Writes a register. Arguments: address, value, size (0: from the table). Refuses the command register, which cannot
/// be read back: `send_command` writes it.
author::Procedure write_memory(Dialog& dialog, ProcedureState& found, Arguments arguments);
/// Writes the command register. Only the status of the answer shows that the command was executed, so it is not
/// repeated.
author::Procedure send_command(Dialog& dialog, ProcedureState& found, std::uint8_t command);

/// Makes the present position the zero of the turn, by the position offset. Argument: 1 to save. Errors also:
/// invalid_argument (the position is not valid), not_still (the shaft turns), cross_check_failed (the position is not
/// zero afterwards; the old offset is restored).
author::Procedure zero(Dialog& dialog, ProcedureState& found, Arguments arguments);
/// Sets the turn counter. Arguments: turns, 1 to save. Error also: unsupported (the encoder has no turn counter).
author::Procedure preset_multiturn(Dialog& dialog, ProcedureState& found, Arguments arguments);
/// Starts the self-calibration and polls its status while the shaft is turned; emits each status. Errors also:
/// cross_check_failed (it failed; the detail states why), timeout (it does not end).
author::Procedure self_calibrate(Dialog& dialog, ProcedureState& found);

/// Returns the bytes of a register: `wanted`, or if that is 0 the size in the table; 0 if the table has no such
/// register.
[[nodiscard]] std::uint16_t register_size(std::uint32_t address, std::int64_t wanted);

}  // namespace absenc::encolink
