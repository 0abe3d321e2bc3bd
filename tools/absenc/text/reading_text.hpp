// SPDX-License-Identifier: Apache-2.0
// Prints a reading as text. An invalid value must not look like a good number.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/encoder.hpp"
#include "absenc/client/reading.hpp"
#include "absenc/client/text/json.hpp"
#include "absenc/core/angle.hpp"

namespace absenc::tool {

using namespace client;

/// Reasons why it is not known whether a position is valid.
enum class Doubt : std::uint8_t {
  none,
  // No second reading has confirmed the position.
  unconfirmed,
};
[[nodiscard]] inline Doubt doubt_of(const Sample& sample) { return sample.doubtful ? Doubt::unconfirmed : Doubt::none; }

/// Returns a reading as one line: " 204.800 deg   74565 counts   4660 turns   alarms: over_heat".
[[nodiscard]] std::string reading_text(const Unit& unit, const Reading& reading, Doubt doubt = Doubt::none);

/// Returns position and turns, the first part of the line that `reading_text` returns.
[[nodiscard]] std::string place_text(const Reading& reading, Doubt doubt = Doubt::none);

/// Returns flags as text, such as "no alarms", "alarms: over_heat" or "alarms not reported".
[[nodiscard]] std::string flags_text(const Unit& unit, const Flags& flags);

/// Returns one line for each set flag, with its meaning and advice; "" if no flag is set.
[[nodiscard]] std::string flags_in_words(const Flags& flags, bool beside_alarms = false);
/// Returns the raised alarms in words.
[[nodiscard]] std::string alarms_in_words(const Unit& unit, const Reading& reading);

/// Sets the JSON keys that state validity and alarms. A key is null if the encoder does not report its value.
void set_state(Json& json, const Unit& unit, const Reading& reading);

/// Returns millimetres as text "0.125", with the decimals (at most 9) that one count of `unit_um` micrometres needs.
[[nodiscard]] std::string millimetres_text(double millimetres, double unit_um);

}  // namespace absenc::tool
