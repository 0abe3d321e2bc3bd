// SPDX-License-Identifier: Apache-2.0
// Prints a reading as text. An invalid value never looks like a good number, and unreported alarms never look like
// "no alarms".
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

/// Reason why the validity of a position is unknown.
enum class Doubt : std::uint8_t {
  none,
  // No second reading confirmed the position. With `none`, the validity is unknown because no reply reports it.
  unconfirmed,
};
[[nodiscard]] inline Doubt doubt_of(const Sample& sample) { return sample.doubtful ? Doubt::unconfirmed : Doubt::none; }

/// Returns a reading as one line: " 204.800 deg   74565 counts   4660 turns   alarms: over_heat"; for a linear encoder
/// "  78.96355 mm      78963.55 um   1579271 counts   no alarms". If some alarms are not reported, also the status:
/// "position unknown (43981)   status: alarm   alarms not reported".
[[nodiscard]] std::string reading_text(const Unit& unit, const Reading& reading, Doubt doubt = Doubt::none);

/// Returns position and turns, the first part of the line that `reading_text` returns.
[[nodiscard]] std::string place_text(const Reading& reading, Doubt doubt = Doubt::none);

/// Returns flags as text, such as "no alarms", "alarms: over_heat", "alarms not reported" or "alarms: counting_error
/// (not reported: over_speed)"; for flags of a status "status clear" or "status: alarm". Unreported flags are named if
/// they are at most four, and not all flags.
[[nodiscard]] std::string flags_text(const Unit& unit, const Flags& flags);

/// Returns one line for each set flag, with its meaning and what the user should do; "" if no flag is set. With
/// `beside_alarms`, a flag that summarises alarms has no advice.
[[nodiscard]] std::string flags_in_words(const Flags& flags, bool beside_alarms = false);
/// Returns the raised alarms in words. With two channels, the channel's name stands before its alarms; if both raise
/// the same alarms, these are listed once.
[[nodiscard]] std::string alarms_in_words(const Unit& unit, const Reading& reading);

/// Sets the keys singleturn_valid and multiturn_valid if the reading has these parts, and "alarms", of all channels
/// together, if the unit has alarms. null means that no reply reports the value; for the alarms, that none is raised
/// and not all are reported.
void set_state(Json& json, const Unit& unit, const Reading& reading);

/// Returns millimetres as text "0.125", with no more decimals than one count of `unit_um` micrometres has.
[[nodiscard]] std::string millimetres_text(double millimetres, double unit_um);

}  // namespace absenc::tool
