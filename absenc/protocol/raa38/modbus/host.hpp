// SPDX-License-Identifier: Apache-2.0
// Host procedures of an RAA38S6 over Modbus RTU; README.md gives the reasons. Because the memory wears out, a setting
// is sent once. Address, baud rate and zero are not sent if the encoder has them already, unless the argument `force`
// is 1. Each setting is read back if the protocol allows it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/protocol/raa38/modbus/frame.hpp"
#include "absenc/protocol/sentence.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::rtu {

/// Returns cause and advice for the error of `reply` to `request`. `request` may be empty; with an empty reply,
/// explains why no reply was received, or what is wrong with the request.
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

/// Values of frames and commands. Only members with a value are reported.
struct Values {
  std::optional<std::uint16_t> address{};         ///< Address of the encoder.
  std::optional<std::uint16_t> function{};        ///< Function code of the frame.
  std::optional<std::uint16_t> first_register{};  ///< First register that the request reads.
  std::optional<std::uint16_t> registers{};       ///< Number of registers that the request reads.
  std::optional<std::uint32_t> singleturn{};      ///< Position within the turn, in counts.
  std::optional<double> angle{};                  ///< Position within the turn, in degrees.
  std::optional<std::uint16_t> new_address{};     ///< Address that function A1 gives to the encoder.
  std::optional<std::uint16_t> parameter{};       ///< Parameter of function CC.
  std::optional<std::string_view> setting{};      ///< Meaning of the parameter in words.
  std::optional<std::string_view> crc_order{};    ///< Byte order of the CRC: low_first or high_first.
  std::optional<std::uint32_t> baud{};            ///< Baud rate at which the encoder answers, in bits per second.
  std::optional<std::string_view> direction{};    ///< Sentence about the counting direction, which no request reads.
  /// Sentence about the change of the position by a direction setting.
  std::optional<std::string_view> effect{};
  std::optional<bool> written{};                   ///< Whether a setting was sent; false if the encoder has it already.
  std::optional<std::uint16_t> encoder_address{};  ///< Address that answered during a scan.
  std::optional<bool> clash{};                     ///< Whether the answers of this address were damaged every time.
  /// True: this address answers with an exception; otherwise no value.
  std::optional<bool> refuses{};
};

/// Result of a command: values, reading and error text.
struct CommandValues : Values {
  Reading reading{};  ///< Position as a reading; empty if none was read.
  Sentence words{};   ///< Storage of the text that explains an error.
};

/// Interface by which procedures send requests and await replies.
using Dialog = author::DialogOf<Protocol>;

// When no encoder answers at the address of the format, the procedures below except `read_address` and `scan` send A0,
// but not after they have sent a setting. If an encoder with another address answers, their error text names that
// address.

/// Reads the position once and reports it.
author::Procedure read_position_once(Dialog& dialog, CommandValues& found);

/// Reads the position for the direction command: no request reads the direction, so only the position can be reported.
author::Procedure read_direction(Dialog& dialog, CommandValues& found);

/// Reads the address with A0. If A0 gets no valid reply, as with several encoders on the line, and the line becomes
/// silent, checks whether the encoder at the address of the format answers.
author::Procedure read_address(Dialog& dialog, CommandValues& found);

/// Finds the baud rate at which the encoder answers: tries the rate of the format first, then the others. Leaves the
/// line at its old rate. Errors: invalid_argument (the position has more bits than one requested register), timeout, or
/// the error of the reply at the rate of the format, or of a line that is never silent.
author::Procedure find_baud(Dialog& dialog, CommandValues& found);

/// Result of a scan of the slaves on a line. The scan sends A0 first; if a single encoder answers it and its position
/// can be read, the scan ends. Otherwise it requests every address from the first argument to the second. If all
/// replies of an address are damaged, two encoders share it or the line is bad. Errors: timeout if no slave answers,
/// invalid_argument if the last address is before the first or if the position has more bits than one requested
/// register, or the error of a line that is never silent.
struct Slaves {
  /// Result of polling one address: no answer, a valid answer, three damaged answers, or a refusal.
  enum class Kind : std::uint8_t { none, answers, clash, refuses };
  std::array<Kind, modbus::last_address + 1> at{};  ///< Result of each address, which is the index; 0 is unused.
};
/// Scans the line for slaves.
author::Procedure scan(Dialog& dialog, Slaves& found, Arguments arguments);

/// Sets the address with A1. Refuses an address at which another slave answers (invalid_argument). Then reads the
/// position at the new address to verify. Errors besides those of reading the position: request_rejected,
/// cross_check_failed (the encoder still has its old address), timeout (the encoder answers at neither address).
author::Procedure set_address(Dialog& dialog, CommandValues& found, Arguments arguments);

/// Sets the baud rate of encoder and line with CC and verifies that the encoder answers. Errors besides those of
/// reading the position: invalid_argument (the encoder does not have this rate), cross_check_failed (the encoder still
/// has its old rate), timeout (the encoder answers at neither rate). After an error the line has its old rate.
author::Procedure set_baud(Dialog& dialog, CommandValues& found, Arguments arguments);

/// Sets the counting direction with CC and reports how the position changed. Only the echo of the request confirms the
/// setting.
author::Procedure set_direction(Dialog& dialog, CommandValues& found, Arguments arguments);

/// Makes the present position zero with CC 00. Errors besides those of reading the position: not_still (the shaft
/// turns), cross_check_failed (the position is not zero afterwards).
author::Procedure set_zero(Dialog& dialog, CommandValues& found, Arguments arguments);

}  // namespace absenc::raa38::rtu
