// SPDX-License-Identifier: Apache-2.0
// Readings from replies of EnDat, with their alarms. Sections are those of README.md.
#pragma once

#include <cstdint>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/protocol/endat/frame.hpp"

namespace absenc::endat {

/// Bits of the alarms of a reading.
namespace alarm {
inline constexpr std::uint32_t errors = 0x7F;       ///< Error messages: word 0 of the operating status.
inline constexpr unsigned warnings_shift = 8;       ///< Place of the warnings: word 1 of the operating status.
inline constexpr std::uint32_t warnings = 0x1F00;   ///< Warnings.
inline constexpr std::uint32_t error = 1u << 14;    ///< F1 or F2: the position is wrong.
inline constexpr std::uint32_t warning = 1u << 15;  ///< WRN: at least one warning is set.
}  // namespace alarm

/// Returns the alarms of the words of the operating status.
[[nodiscard]] constexpr std::uint32_t alarms_of(std::uint16_t errors, std::uint16_t warnings) {
  return (errors & alarm::errors) | (std::uint32_t{warnings} << alarm::warnings_shift & alarm::warnings);
}

/// Completes a reading by the error messages and warnings that were read behind it.
constexpr void add_alarms(Reading& reading, const AlarmWords& words) {
  const auto [errors, warnings] = words;
  // WRN is known from additional information only, unless a warning is set.
  const bool knows_group = warnings != 0 || (reading.alarms_reported & alarm::warning) != 0;
  reading.alarms &= alarm::error | alarm::warning;
  const bool wrong = errors != 0 || reading.singleturn_valid_bits == 0;
  reading.alarms |= alarms_of(errors, warnings) | (wrong ? alarm::error : 0) | (warnings != 0 ? alarm::warning : 0);
  reading.alarms_reported = alarm::errors | alarm::warnings | alarm::error | (knows_group ? alarm::warning : 0);
  if (errors != 0) reading.singleturn_valid_bits = 0;
  reading.multiturn_valid = reading.multiturn_valid && errors == 0;
}

/// Returns whether an error bit says that the position is wrong.
[[nodiscard]] constexpr bool has_error(ModeCommand code, const Reply& reply) {
  return reply.f1 || (is_22(code) && !reply.f2);
}

/// Returns the reading of a reply; an empty one if the reply has no position. F1 and F2 say whether any error message
/// is set, WRN says the same of warnings; without additional information warnings are not reported.
[[nodiscard]] constexpr Reading reading_of(const Format& given, ModeCommand code, const Reply& reply) {
  Reading reading;
  if (!has_position(code)) return reading;
  const Format format = with_resolution(given);
  const bool wrong = has_error(code, reply);
  const Resolution resolution = format.resolution();
  reading.unit_um = resolution.unit_um;
  reading.singleturn_bits = resolution.singleturn_bits;
  reading.multiturn_bits = resolution.multiturn_bits;
  reading.singleturn = reply.position & low_mask(resolution.singleturn_bits);
  reading.multiturn = resolution.multiturn_bits == 0 ? 0 : reply.position >> resolution.singleturn_bits;
  reading.singleturn_valid_bits = wrong ? 0 : resolution.singleturn_bits;
  reading.multiturn_valid = !wrong && resolution.multiturn_bits != 0;
  if (!wrong) reading.alarms_reported = alarm::error | alarm::errors;
  // Without additional information nothing tells of warnings, nor which error message is set: which alarms are raised
  // stays open until they are read.
  if (reply.info_count != 0) {
    reading.alarms = wrong ? alarm::error : 0;
    reading.alarms_reported |= alarm::error;
    const bool warns = reply.infos[0].warning;
    if (warns) reading.alarms |= alarm::warning;
    reading.alarms_reported |= warns ? alarm::warning : alarm::warning | alarm::warnings;
  }
  if (reply.alarm_words) add_alarms(reading, *reply.alarm_words);
  return reading;
}

}  // namespace absenc::endat
