// SPDX-License-Identifier: Apache-2.0
// Host procedures of an RAA38S6 over Modbus RTU; README.md gives the reasons. A setting is sent once, and not at all if
// the encoder has it already, because its memory wears out. Each setting is read back if the protocol allows it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/protocol/raa38/modbus/frame.hpp"
#include "absenc/protocol/sentence.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::rtu {

/// Explains an error: of `reply` to `request`, which may be empty; with an empty reply, why none was received or what
/// is wrong with the request.
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

/// Fields of frames and commands, in the order of the report.
struct Values {
  std::optional<std::uint16_t> address{};          ///< Address.
  std::optional<std::uint16_t> function{};         ///< Value of the field `function`, if there is one.
  std::optional<std::uint16_t> first_register{};   ///< Value of the field `first_register`, if there is one.
  std::optional<std::uint16_t> registers{};        ///< Value of the field `registers`, if there is one.
  std::optional<std::uint32_t> singleturn{};       ///< Value of the field `singleturn`, if there is one.
  std::optional<double> angle{};                   ///< Value of the field `angle`, if there is one.
  std::optional<std::uint16_t> new_address{};      ///< Value of the field `new_address`, if there is one.
  std::optional<std::uint16_t> parameter{};        ///< Value of the field `parameter`, if there is one.
  std::optional<std::string_view> setting{};       ///< Value of the field `setting`, if there is one.
  std::optional<std::string_view> crc_order{};     ///< Value of the field `crc_order`, if there is one.
  std::optional<std::uint32_t> baud{};             ///< Value of the field `baud`, if there is one.
  std::optional<std::string_view> direction{};     ///< Value of the field `direction`, if there is one.
  std::optional<std::string_view> effect{};        ///< Value of the field `effect`, if there is one.
  std::optional<bool> written{};                   ///< Value of the field `written`, if there is one.
  std::optional<std::uint16_t> encoder_address{};  ///< Value of the field `encoder_address`, if there is one.
  std::optional<bool> clash{};                     ///< Value of the field `clash`, if there is one.
  std::optional<bool> refuses{};                   ///< Value of the field `refuses`, if there is one.
};

/// Result of a command.
struct CommandValues : Values {
  Reading reading{};  ///< The position.
  Sentence words{};   ///< text of the error's detail
};

/// Interface by which procedures send requests and await replies.
using Dialog = author::DialogOf<Protocol>;

// If no encoder answers at the address of the format, all these procedures send A0 and name the address in its reply.

/// Reads the position once.
author::Procedure read_position_once(Dialog& dialog, CommandValues& found);

/// Reads the position: no command reads the direction, so the position is all that can be reported.
author::Procedure read_direction(Dialog& dialog, CommandValues& found);

/// Reads the address with A0. If A0 gets no valid reply, as with several encoders on the line, checks whether the
/// encoder at the address of the format answers.
author::Procedure read_address(Dialog& dialog, CommandValues& found);

/// Finds the baud rate at which the encoder answers: first that of the format, then the others. Leaves the line at its
/// old rate. Error: timeout, or that of the reply at the rate of the format.
author::Procedure find_baud(Dialog& dialog, CommandValues& found);

/// Finds the slaves on a line. Sends A0 first, which a single encoder answers, otherwise requests every address from
/// the first argument to the second. If all replies of an address are damaged, two encoders share it or the line is
/// bad. Error: timeout if no slave answers.
struct Slaves {
  /// Result of polling an address.
  enum class Kind : std::uint8_t { none, answers, clash, refuses };
  std::array<Kind, modbus::last_address + 1> at{};  ///< Result of polling each address.
};
/// Procedure that finds all encoders on a line.
author::Procedure scan(Dialog& dialog, Slaves& found, Arguments arguments);

/// Sets the address with A1. Refuses an address at which another slave answers (invalid_argument). Reads the position
/// at the new address to verify; errors: cross_check_failed (it still has its old address), timeout (it answers at
/// neither).
author::Procedure set_address(Dialog& dialog, CommandValues& found, Arguments arguments);

/// Sets the baud rate with CC, sets the line to it and verifies there. Errors: invalid_argument (the encoder does not
/// have this rate), cross_check_failed (it still has its old rate), timeout (it answers at neither). After an error the
/// line has its old rate.
author::Procedure set_baud(Dialog& dialog, CommandValues& found, Arguments arguments);

/// Sets the direction with CC. Only the echo of the request confirms it. Reports how the position changed.
author::Procedure set_direction(Dialog& dialog, CommandValues& found, Arguments arguments);

/// Makes the present position zero with CC 00. Errors also: not_still (the shaft turns), cross_check_failed (the
/// position is not zero afterwards).
author::Procedure set_zero(Dialog& dialog, CommandValues& found, Arguments arguments);

}  // namespace absenc::raa38::rtu
