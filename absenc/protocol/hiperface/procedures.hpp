// SPDX-License-Identifier: Apache-2.0
// Procedures of a host for HIPERFACE encoders. A request that stores something is not repeated after an error; another
// request shows whether it was executed.
#pragma once

#include <cstdint>
#include <optional>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/hiperface/fields.hpp"

namespace absenc::hiperface {

/// Interface by which procedures send requests and await replies.
using Dialog = author::DialogOf<Protocol>;

/// Result of a procedure: the values of its fields, a reading, and storage for bytes to which the values refer.
struct ProcedureResult : Values {
  Reading reading{};  ///< Position and turns; empty if the procedure read none.
  /// Storage of the bytes of a data field, or of the characters of a serial number or program version, that are
  /// reported.
  FieldBytes bytes{};
};

/// Converts an argument, whose value is 0 to 255, to a byte.
[[nodiscard]] constexpr std::uint8_t byte(std::int64_t argument) { return static_cast<std::uint8_t>(argument); }
/// Returns the request of a command without data. If the options do not state the resolution, any resolution in the
/// reply is accepted.
[[nodiscard]] constexpr Request plain_request(const Format& format, CommandCode command) {
  return {.command = command, .address = format.address, .any_resolution = !format.is_known()};
}
/// Returns the index of a baud rate in `rates`; no value if the encoder does not have the rate.
[[nodiscard]] constexpr std::optional<std::uint8_t> rate_index(std::int64_t baud) {
  for (std::uint8_t i = 0; i < rates.size(); ++i) {
    if (rates[i] == baud) return i;
  }
  return std::nullopt;
}
/// Returns the status of a data field of `size` bytes that exists and needs the access code `number`, 0 to 3.
[[nodiscard]] constexpr std::uint8_t status_of_field(std::int64_t size, std::int64_t number, bool writable) {
  return static_cast<std::uint8_t>(field_status::exists | field_status::needs_code |
                                   static_cast<unsigned>(number) << 4 | (writable ? field_status::writable : 0) |
                                   ((static_cast<std::size_t>(size) / block_size - 1) & field_status::size));
}

/// Reads the position. If the reply has the error bit, also reads the status, to learn whether the position is valid.
author::Procedure read_position(Dialog& dialog, ProcedureResult& found);
/// Reads the status until a status code comes again or is no alarm, and reports the alarms that the codes name.
author::Procedure read_status(Dialog& dialog, ProcedureResult& found);
/// Reads the type label, the serial number and the program version; skips the last two if the encoder refuses them. If
/// the type needs it, also reads the description in data field FF.
author::Procedure read_info(Dialog& dialog, ProcedureResult& found);
/// Sends the request of `command` for the analog channel or the data field in the first argument.
author::Procedure ask_about(Dialog& dialog, ProcedureResult& found, CommandCode command, Arguments arguments);
/// Reads the address of the only encoder of the line.
author::Procedure read_address(Dialog& dialog, ProcedureResult& found);
/// Reads the interface setting (baud rate, parity, timeout) of the encoder.
author::Procedure read_baud(Dialog& dialog, ProcedureResult& found);

/// Makes the present position within the turn zero; the turns stay. Errors besides those of the exchanges: unsupported
/// (the resolution is unknown), not_still, invalid_argument (the position is not valid), cross_check_failed (the
/// position is another one afterwards).
author::Procedure set_zero(Dialog& dialog, ProcedureResult& found);
/// Sets the turns to 0; the position within the turn stays. Errors as `set_zero`, and unsupported without turns.
author::Procedure reset_multiturn(Dialog& dialog, ProcedureResult& found);
/// Sets the position, which contains the turns, to the first argument. Errors as `set_zero`, and invalid_argument (the
/// encoder has no such position).
author::Procedure set_position(Dialog& dialog, ProcedureResult& found, Arguments arguments);
/// Resets the encoder, and waits some seconds for it to answer again.
author::Procedure reset(Dialog& dialog, ProcedureResult& found);

/// Increments the encoder's counter by one.
author::Procedure count_up(Dialog& dialog, ProcedureResult& found);
/// Sets the encoder's counter to 0.
author::Procedure clear_counter(Dialog& dialog, ProcedureResult& found);

/// Reads bytes of a data field. Arguments: address, data field, number of bytes.
author::Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);
/// Writes a byte of a data field, unless it has the value already. Arguments: address, value, data field.
author::Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments);
/// Creates a data field, or changes its status. Arguments: data field, size in bytes, number of its access code, 1 if
/// it shall be writable.
author::Procedure create_field(Dialog& dialog, ProcedureResult& found, Arguments arguments);
/// Changes an access code. To verify it, changes the new code to itself, which the encoder refuses if it has another
/// code. Arguments: number of the access code, old code, new code.
author::Procedure set_access_code(Dialog& dialog, ProcedureResult& found, Arguments arguments);

/// Gives the encoder another address. Errors besides those of the exchanges: invalid_argument (an encoder answers at
/// that address already), cross_check_failed (the encoder still has its old address).
author::Procedure set_address(Dialog& dialog, ProcedureResult& found, Arguments arguments);
/// Sets the baud rate of encoder and line; the other bits of the interface setting stay. After an error the line has
/// its old rate.
author::Procedure set_baud(Dialog& dialog, ProcedureResult& found, Arguments arguments);

}  // namespace absenc::hiperface
