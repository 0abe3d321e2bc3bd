// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text/reading_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "absenc/client/row.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/core/bits.hpp"
#include "tools/absenc/text/field_text.hpp"

namespace absenc::tool {

using namespace client;

namespace {

// Returns how many decimals of degrees are needed to tell neighbouring counts of `bits` bits apart.
int decimals(unsigned bits) {
  return std::max(0, static_cast<int>(std::ceil(std::log10(std::ldexp(1.0, static_cast<int>(bits)) / 360))));
}

// Returns how many decimals of millimetres, at most 9, a count of `unit_um` micrometres needs.
int linear_decimals(double unit_um) {
  int decimals = 9;
  for (auto nanometres_e3 = std::llround(unit_um * 1e6); decimals > 0 && nanometres_e3 % 10 == 0; --decimals) {
    nanometres_e3 /= 10;
  }
  return decimals;
}

// Returns the number of digits of the largest number of `bits` bits.
int digits(unsigned bits) { return static_cast<int>(fmt::formatted_size("{}", low_mask(bits))); }

std::string linear_text(const Reading& reading) {
  const unsigned bits = reading.singleturn_bits;
  const double most = micrometres(low_mask(bits), reading.unit_um);
  const double um = micrometres(reading.singleturn, reading.unit_um);
  const int behind_mm = linear_decimals(reading.unit_um);
  const int behind_um = std::max(0, behind_mm - 3);
  const std::size_t width_mm = fmt::formatted_size("{:.{}f}", most / 1000, behind_mm);
  const std::size_t width_um = fmt::formatted_size("{:.{}f}", most, behind_um);
  return fmt::format("{:>{}.{}f} mm   {:>{}.{}f} um   {:>{}} counts", um / 1000, width_mm, behind_mm, um, width_um,
                     behind_um, reading.singleturn, digits(bits));
}

std::string_view unknown_word(Doubt doubt) { return doubt == Doubt::unconfirmed ? "unconfirmed" : "unknown"; }

std::string position_text(const Reading& reading, Doubt doubt) {
  const unsigned bits = reading.singleturn_bits;
  const unsigned valid = reading.singleturn_valid_bits;
  if (!reading.ready) return fmt::format("position INVALID ({}: the encoder is starting)", reading.singleturn);
  if (!reading.singleturn_known) return fmt::format("position {} ({})", unknown_word(doubt), reading.singleturn);
  if (valid == 0) return fmt::format("position INVALID ({})", reading.singleturn);
  if (reading.unit_um > 0) return linear_text(reading);
  const std::string angle = fmt::format("{:.{}f}", degrees(reading.singleturn, bits), decimals(valid));
  if (valid < bits)
    return fmt::format("position INVALID (only the top {} of {} bits hold: {} deg)", valid, bits, angle);
  const int width = decimals(bits) == 0 ? 3 : decimals(bits) + 4;
  return fmt::format("{:>{}} deg   {:>{}} counts", angle, width, reading.singleturn, digits(bits));
}

std::string turns_text(const Reading& reading, Doubt doubt) {
  if (!reading.multiturn_known) return fmt::format("turns {} ({})", unknown_word(doubt), reading.turns());
  if (!reading.multiturn_valid) return fmt::format("turns INVALID ({})", reading.turns());
  return fmt::format("{:>{}} turns", reading.turns(), digits(reading.multiturn_bits));
}

std::vector<Flags> flags_in_line(const Unit& unit, const Reading& reading) {
  if (unit.second_status != nullptr || unit.second_alarms != nullptr) return flags_of(unit, reading);
  const std::vector<Flags> alarms = alarms_of(unit, reading);
  if (!alarms.empty() && alarms.front().is_complete()) return alarms;
  return flags_of(unit, reading);
}

// For an encoder with two channels, returns whether it is ready, reports all flags, and has no flag set that requires
// an action.
bool both_channels_are_well(const Unit& unit, const Reading& reading) {
  if (unit.second_status == nullptr || unit.second_alarms == nullptr || !reading.ready) return false;
  const std::vector<Flags> all = flags_of(unit, reading);
  return all.size() == 4 && std::all_of(all.begin(), all.end(), [](const Flags& flags) {
           const std::vector<const FlagInfo*> set = raised(*flags.field, flags.bits);
           return flags.is_complete() &&
                  std::all_of(set.begin(), set.end(), [](const auto* one) { return one->action.empty(); });
         });
}

}  // namespace

std::string place_text(const Reading& reading, Doubt doubt) {
  std::string text;
  if (reading.singleturn_bits != 0) text = position_text(reading, doubt);
  if (reading.multiturn_bits != 0) text += (text.empty() ? "" : "   ") + turns_text(reading, doubt);
  return text;
}

std::string flags_text(const Unit& unit, const Flags& flags) {
  const std::vector<std::string_view> names = flag_names(*flags.field, flags.bits);
  std::vector<std::string_view> open;
  if (!flags.is_complete()) open = flag_names(*flags.field, ~flags.reported);
  const std::string_view name = flags.field->name;
  const bool is_status = flags.field == unit.status || flags.field == unit.second_status;
  if (names.empty() && open.empty()) return is_status ? fmt::format("{} clear", name) : fmt::format("no {}", name);
  constexpr std::size_t most_named = 4;
  const bool is_named = open.size() <= most_named && open.size() < flag_names(*flags.field, ~0ull).size();
  const std::string which = is_named ? fmt::format(": {}", fmt::join(open, " ")) : "";
  if (names.empty()) return fmt::format("{} not reported{}", name, which);
  const std::string text = fmt::format("{}: {}", name, fmt::join(names, " "));
  return open.empty() ? text : fmt::format("{} ({}not reported{})", text, is_named ? "" : "others ", which);
}

std::string reading_text(const Unit& unit, const Reading& reading, Doubt doubt) {
  std::string text = place_text(reading, doubt);
  if (both_channels_are_well(unit, reading)) return text + "   both channels ready   no alarms";
  for (const Flags& flags : flags_in_line(unit, reading)) {
    text += (text.empty() ? "" : "   ") + flags_text(unit, flags);
  }
  return text;
}

std::string millimetres_text(double millimetres, double unit_um) {
  return fmt::format("{:.{}f}", millimetres, linear_decimals(unit_um));
}

std::string flags_in_words(const Flags& flags, bool beside_alarms) {
  std::string lines;
  for (const FlagInfo* flag : raised(*flags.field, flags.bits)) {
    if (!lines.empty()) lines += '\n';
    lines += fmt::format("  {}: {}", flag->name, flag->meaning);
    const std::string_view action = action_of(*flag, beside_alarms);
    if (!action.empty()) lines += fmt::format(". What to do: {}", action);
  }
  return lines;
}

std::string alarms_in_words(const Unit& unit, const Reading& reading) {
  const std::vector<Flags> alarms = alarms_of(unit, reading);
  if (alarms.size() == 2 && alarms[0].bits == alarms[1].bits && alarms[0].bits != 0) {
    return fmt::format("{}, {}:\n{}", alarms[0].field->name, alarms[1].field->name, flags_in_words(alarms[0]));
  }
  std::string lines;
  for (const Flags& flags : alarms) {
    const std::string words = flags_in_words(flags);
    if (words.empty()) continue;
    if (!lines.empty()) lines += '\n';
    lines += alarms.size() > 1 ? fmt::format("{}:\n{}", flags.field->name, words) : words;
  }
  return lines;
}

void set_state(Json& json, const Unit& unit, const Reading& reading) {
  const Validity singleturn = reading.ready ? reading.singleturn_validity() : Validity::invalid;
  if (reading.singleturn_bits != 0) json.set("singleturn_valid", to_json(value_of(singleturn)));
  if (reading.multiturn_bits != 0) json.set("multiturn_valid", to_json(value_of(reading.multiturn_validity())));
  if (const std::optional<Flags> alarms = joined_alarms(unit, reading)) json.set("alarms", to_json(value_of(*alarms)));
}

}  // namespace absenc::tool
