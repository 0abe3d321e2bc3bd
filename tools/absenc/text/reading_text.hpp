// SPDX-License-Identifier: Apache-2.0
// A position reading for people. What is not valid never looks like a good number, and what nobody has reported never
// looks like "no alarms".
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

/// Why it is unknown whether a position holds.
enum class Doubt : std::uint8_t {
  none,
  unconfirmed,  // no second reading agreed with it; else no reply has reported whether it holds
};
[[nodiscard]] inline Doubt doubt_of(const Sample& sample) { return sample.doubtful ? Doubt::unconfirmed : Doubt::none; }

/// " 204.800 deg   74565 counts   4660 turns   alarms: over_heat"; of a linear encoder
/// "  78.96355 mm      78963.55 um   1579271 counts   no alarms". Where not all alarms were reported, also the status:
/// "position unknown (43981)   status: alarm   alarms not reported".
[[nodiscard]] std::string reading_text(const Unit& unit, const Reading& reading, Doubt doubt = Doubt::none);

/// Its first part: position and turns.
[[nodiscard]] std::string place_text(const Reading& reading, Doubt doubt = Doubt::none);

/// "no alarms", "alarms: over_heat", "alarms not reported", "alarms: counting_error (not reported: over_speed)"; of a
/// status "status clear", "status: alarm".
[[nodiscard]] std::string flags_text(const Unit& unit, const Flags& flags);

/// What each flag that is set means and what to do, a line each; "" when there is none.
[[nodiscard]] std::string flags_in_words(const Flags& flags, bool beside_alarms = false);
/// Of two channels under the name of each; what both raise once.
[[nodiscard]] std::string alarms_in_words(const Unit& unit, const Reading& reading);

/// Sets singleturn_valid and multiturn_valid, as far as the reading carries them, and the alarms of all channels, where
/// the unit has some; null: nobody has reported it.
void set_state(Json& json, const Unit& unit, const Reading& reading);

/// "0.125" without more decimals than the unit of a count has.
[[nodiscard]] std::string millimetres_text(double millimetres, double unit_um);

}  // namespace absenc::tool
