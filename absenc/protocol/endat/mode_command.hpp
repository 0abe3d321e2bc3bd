// SPDX-License-Identifier: Apache-2.0
// Mode commands of EnDat 2.1 and 2.2. Sections are those of README.md.
#pragma once

#include <cstdint>

#include "absenc/protocol/endat/format.hpp"

namespace absenc::endat {

/// Mode commands, the six bits of a request.
enum class ModeCommand : std::uint8_t {
  position = 0b000'111,
  select = 0b001'110,
  write = 0b011'100,
  read = 0b100'011,
  reset = 0b101'010,
  test_values = 0b010'101,
  test = 0b110'001,
  communicate = 0b010'010,
  position_22 = 0b111'000,
  select_22 = 0b001'001,
  write_22 = 0b011'011,
  read_22 = 0b100'100,
  error_reset_22 = 0b101'101,
  test_22 = 0b110'110,
};

/// Returns whether `code` is a mode command of section "Mode commands".
[[nodiscard]] constexpr bool is_code(std::uint8_t code) {
  switch (static_cast<ModeCommand>(code)) {
    case ModeCommand::position:
    case ModeCommand::select:
    case ModeCommand::write:
    case ModeCommand::read:
    case ModeCommand::reset:
    case ModeCommand::test_values:
    case ModeCommand::test:
    case ModeCommand::communicate:
    case ModeCommand::position_22:
    case ModeCommand::select_22:
    case ModeCommand::write_22:
    case ModeCommand::read_22:
    case ModeCommand::error_reset_22:
    case ModeCommand::test_22:
      return true;
  }
  return false;
}
/// Returns whether the host sends 24 bits of parameters directly behind the mode command.
[[nodiscard]] constexpr bool has_parameters(ModeCommand code) {
  return code == ModeCommand::select || code == ModeCommand::write || code == ModeCommand::read ||
         code == ModeCommand::reset || code == ModeCommand::test || code == ModeCommand::communicate;
}
/// Returns whether the host sends a supplement of 24 bits behind the position.
[[nodiscard]] constexpr bool has_supplement(ModeCommand code) {
  return code == ModeCommand::select_22 || code == ModeCommand::write_22 || code == ModeCommand::read_22 ||
         code == ModeCommand::error_reset_22 || code == ModeCommand::test_22;
}
/// Returns whether the reply has a position with two error bits and additional information (EnDat 2.2).
[[nodiscard]] constexpr bool is_22(ModeCommand code) {
  return code == ModeCommand::position_22 || has_supplement(code);
}
/// Returns whether the reply has a position.
[[nodiscard]] constexpr bool has_position(ModeCommand code) { return code == ModeCommand::position || is_22(code); }

/// Returns the mode command that reads a position from an encoder with this format.
[[nodiscard]] constexpr ModeCommand position_command(const Format& format) {
  return format.version == CommandSet::v21 ? ModeCommand::position : ModeCommand::position_22;
}

}  // namespace absenc::endat
