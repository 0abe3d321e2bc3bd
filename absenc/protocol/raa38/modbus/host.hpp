// SPDX-License-Identifier: Apache-2.0
// Host procedures of an RAA38S6 over Modbus RTU; README.md gives the reasons.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/protocol/raa38/modbus/frame.hpp"
#include "absenc/protocol/sentence.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::rtu {

/// Returns cause and advice for an error of `request` or `reply`; either may be empty.
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

/// Values that a frame contains, or that a command gives as its result. Only members that have a value are reported.
struct Values {
  std::optional<std::uint16_t> address{};         ///< Address of the encoder.
  std::optional<std::uint16_t> function{};        ///< Function code of the frame.
  std::optional<std::uint16_t> first_register{};  ///< First register that the request reads.
  std::optional<std::uint16_t> registers{};       ///< Number of registers that the request reads.
  std::optional<std::uint32_t> singleturn{};      ///< Position within the turn, in counts.
  std::optional<double> angle{};                  ///< Position within the turn, in degrees.
  std::optional<std::uint16_t> new_address{};     ///< Address that function A1 gives to the encoder.
  std::optional<std::uint16_t> parameter{};       ///< Number of the parameter of function CC in the request or reply.
  std::optional<std::string_view> setting{};      ///< Meaning of the parameter of function CC in words.
  std::optional<std::string_view> crc_order{};    ///< Byte order of the CRC: low_first or high_first.
  std::optional<std::uint32_t> baud{};            ///< Baud rate at which the encoder answers, in bits per second.
  std::optional<std::string_view> direction{};    ///< Sentence for the user: no request reads the counting direction.
  /// Sentence for the user about how the position changed when the direction was set.
  std::optional<std::string_view> effect{};
  std::optional<bool> written{};  ///< True if a setting was sent; false if the encoder had this value already.
  std::optional<std::uint16_t> encoder_address{};  ///< Scan: an address that answered.
  std::optional<bool> clash{};  ///< Scan: whether all answers of the address `encoder_address` were damaged.
  /// Scan: true if the address `encoder_address` answers with an exception; otherwise no value.
  std::optional<bool> refuses{};
};

/// Result of a command: values, reading and error text.
struct CommandValues : Values {
  Reading reading{};  ///< Position as a reading; empty if none was read.
  Sentence words{};   ///< Storage of the text that explains an error.
};

/// Interface by which procedures send requests and await replies.
using Dialog = author::DialogOf<Protocol>;

/// Reads the position once and reports it.
author::Procedure read_position_once(Dialog& dialog, CommandValues& found);

/// Reads the position and reports it with a sentence that no request reads the counting direction.
author::Procedure read_direction(Dialog& dialog, CommandValues& found);

/// Reads the address with function A0; if that fails, checks that an encoder answers at the format's address.
author::Procedure read_address(Dialog& dialog, CommandValues& found);

/// Finds the baud rate at which the encoder answers. Errors: invalid_argument, timeout, or that of an exchange.
author::Procedure find_baud(Dialog& dialog, CommandValues& found);

/// Result of a scan of the slaves on a line.
struct Slaves {
  /// Result of polling one address: no answer, a valid answer, damaged answers, or a refusal.
  enum class Kind : std::uint8_t { none, answers, clash, refuses };
  /// Result of polling each address, which is the index; index 0 is unused.
  std::array<Kind, modbus::last_address + 1> at{};
};
/// Polls each address on the line for a slave. Errors: invalid_argument, timeout, or that of an exchange.
author::Procedure scan(Dialog& dialog, Slaves& found, Arguments arguments);

/// Sets the address with function A1 and verifies it. Errors: invalid_argument, request_rejected, cross_check_failed,
/// timeout, or those of reading the position.
author::Procedure set_address(Dialog& dialog, CommandValues& found, Arguments arguments);

/// Sets the baud rate of encoder and line with function CC and verifies it. Errors: invalid_argument,
/// cross_check_failed, timeout, or those of reading the position.
author::Procedure set_baud(Dialog& dialog, CommandValues& found, Arguments arguments);

/// Sets the counting direction with function CC, and reports how the position changed.
author::Procedure set_direction(Dialog& dialog, CommandValues& found, Arguments arguments);

/// Makes the present position zero with function CC, parameter 00. Errors: not_still, cross_check_failed, or those of
/// reading the position.
author::Procedure set_zero(Dialog& dialog, CommandValues& found, Arguments arguments);

}  // namespace absenc::raa38::rtu
