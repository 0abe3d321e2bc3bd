// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text/reading_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/core/bits.hpp"
#include "tools/absenc/text/field_text.hpp"

namespace absenc::tool {

using namespace client;

namespace {

// As many as it takes to tell neighbouring positions apart.
int decimals(unsigned bits) {
  return std::max(0, static_cast<int>(std::ceil(std::log10(std::ldexp(1.0, static_cast<int>(bits)) / 360))));
}

// As many as a count has; options have up to six behind the micrometre.
int linear_decimals(double unit_um) {
  int decimals = 9;
  for (auto nanometres_e3 = std::llround(unit_um * 1e6); decimals > 0 && nanometres_e3 % 10 == 0; --decimals) {
    nanometres_e3 /= 10;
  }
  return decimals;
}

// The digits of the largest number of so many bits.
int digits(unsigned bits) { return static_cast<int>(fmt::formatted_size("{}", low_mask(bits))); }

std::string flags_text(const Flags& flags) {
  return fmt::format("{}", fmt::join(flag_names(*flags.field, flags.bits), " "));
}

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

std::string position_text(const Reading& reading) {
  const unsigned bits = reading.singleturn_bits;
  const unsigned valid = reading.singleturn_valid_bits;
  if (!reading.ready) return fmt::format("position INVALID ({}: the encoder is starting)", reading.singleturn);
  if (valid == 0) return fmt::format("position INVALID ({})", reading.singleturn);
  if (reading.unit_um > 0) return linear_text(reading);
  const std::string angle = fmt::format("{:.{}f}", degrees(reading.singleturn, bits), decimals(valid));
  if (valid < bits)
    return fmt::format("position INVALID (only the top {} of {} bits hold: {} deg)", valid, bits, angle);
  const int width = decimals(bits) == 0 ? 3 : decimals(bits) + 4;
  return fmt::format("{:>{}} deg   {:>{}} counts", angle, width, reading.singleturn, digits(bits));
}

std::string turns_text(const Reading& reading) {
  if (!reading.multiturn_valid) return fmt::format("turns INVALID ({})", reading.multiturn);
  return fmt::format("{:>{}} turns", reading.multiturn, digits(reading.multiturn_bits));
}

}  // namespace

namespace {

// The alarms, of encoders without any the status; of two channels both.
std::vector<Flags> flags_in_line(const Unit& unit, const Reading& reading) {
  if (unit.second_status != nullptr || unit.second_alarms != nullptr) return flags_of(unit, reading);
  return unit.alarms != nullptr ? alarms_of(unit, reading) : status_of(unit, reading);
}

}  // namespace

std::string place_text(const Reading& reading) {
  std::string text;
  if (reading.singleturn_bits != 0) text = position_text(reading);
  if (reading.multiturn_bits != 0) text += (text.empty() ? "" : "   ") + turns_text(reading);
  return text;
}

std::string reading_text(const Unit& unit, const Reading& reading) {
  std::string text = place_text(reading);
  for (const Flags& flags : flags_in_line(unit, reading)) {
    const std::string names = flags_text(flags);
    if (!text.empty()) text += "   ";
    text += names.empty() ? fmt::format("no {}", flags.field->name) : fmt::format("{}: {}", flags.field->name, names);
  }
  return text;
}

std::string millimetres_text(double millimetres, double unit_um) {
  return fmt::format("{:.{}f}", millimetres, linear_decimals(unit_um));
}

std::string flags_in_words(const Flags& flags) {
  std::string lines;
  for (const FlagInfo* flag : raised(*flags.field, flags.bits)) {
    if (!lines.empty()) lines += '\n';
    lines += fmt::format("  {}: {}", flag->name, flag->meaning);
    if (!flag->action.empty()) lines += fmt::format(". What to do: {}", flag->action);
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

void set_validity(Json& json, const Reading& reading) {
  if (reading.singleturn_bits != 0) json.set("singleturn_valid", reading.singleturn_valid() && reading.ready);
  if (reading.multiturn_bits != 0) json.set("multiturn_valid", reading.multiturn_valid);
}

}  // namespace absenc::tool
