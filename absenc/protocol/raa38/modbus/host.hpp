// SPDX-License-Identifier: Apache-2.0
// What a host does with an RAA38S6 over Modbus RTU beside reading its position; README.md says why. A setting is sent
// once, and not at all where the encoder has it already: its memory wears out. What became of it is read back as far as
// anything can be read.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/protocol/raa38/modbus/frame.hpp"
#include "absenc/protocol/sentence.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::rtu {

/// What bad frames turn out to be, in words: a reply to `request`, which may be empty, or with an empty one why none
/// came; or what is wrong with the request.
[[nodiscard]] Explanation explain(const Format& format, Error error, Bytes request, Bytes reply);

/// What frames and commands are shown as, in this order.
struct Values {
  std::optional<std::uint16_t> address{};
  std::optional<std::uint16_t> function{};
  std::optional<std::uint16_t> first_register{};
  std::optional<std::uint16_t> registers{};
  std::optional<std::uint32_t> singleturn{};
  std::optional<double> angle{};
  std::optional<std::uint16_t> new_address{};
  std::optional<std::uint16_t> parameter{};
  std::optional<std::string_view> setting{};
  std::optional<std::string_view> crc_order{};
  std::optional<std::uint32_t> baud{};
  std::optional<std::string_view> direction{};
  std::optional<std::string_view> effect{};
  std::optional<bool> written{};
  std::optional<std::uint16_t> encoder_address{};
  std::optional<bool> clash{};
  std::optional<bool> refuses{};
};

/// What became of a command.
struct Found : Values {
  Reading reading{};
  Sentence words{};  // of the error
};

using Dialog = author::DialogOf<Protocol>;

// Where nobody answers at the address of the format, all of these ask A0, and name the address that it told.

/// One position.
author::Procedure look_once(Dialog& dialog, Found& found);

/// No command reads the direction: the position is all there is to see of it.
author::Procedure look_at_direction(Dialog& dialog, Found& found);

/// A0. Where that gets no good answer, as with several encoders on the line, the one at the address of the format is
/// asked for its position.
author::Procedure ask_address(Dialog& dialog, Found& found);

/// Finds the baud rate at which the encoder answers: first that of the format, then the others. Leaves the line as it
/// was. Error: timeout, or what came at the rate of the format.
author::Procedure find_baud(Dialog& dialog, Found& found);

/// A0 first, which a single encoder answers; otherwise every address from the first argument to the second. An answer
/// that is damaged every time tells of two encoders with one address, or of a bad line. Error: timeout when nobody
/// answers.
struct Slaves {
  enum class Kind : std::uint8_t { none, answers, clash, refuses };
  std::array<Kind, modbus::last_address + 1> at{};
};
author::Procedure scan(Dialog& dialog, Slaves& found, Arguments arguments);

/// A1. Refuses (invalid_argument) an address at which somebody answers. Verified by asking the new address; errors:
/// cross_check_failed (it has its old one), timeout (it answers at neither).
author::Procedure set_address(Dialog& dialog, Found& found, Arguments arguments);

/// CC with a baud rate; verified at the new rate, to which the line is set. Errors: invalid_argument (the encoder does
/// not have it), cross_check_failed (it has its old one), timeout (it answers at neither); then the line is as before.
author::Procedure set_baud(Dialog& dialog, Found& found, Arguments arguments);

/// CC with a direction. Only its echo tells that it was taken; the position before and after is reported.
author::Procedure set_direction(Dialog& dialog, Found& found, Arguments arguments);

/// CC 00: the position becomes 0 here. The shaft must stand still (invalid_argument); read back (cross_check_failed).
author::Procedure set_zero(Dialog& dialog, Found& found, Arguments arguments);

}  // namespace absenc::raa38::rtu
