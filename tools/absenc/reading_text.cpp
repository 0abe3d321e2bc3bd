// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/reading_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "absenc/core/bits.hpp"
#include "tools/absenc/unit_text.hpp"

namespace absenc::tool {

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

std::string flags_text(const FieldInfo* field, std::uint32_t bits) {
  return field == nullptr ? "" : fmt::format("{}", fmt::join(flag_names(*field, bits), " "));
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

std::string to_text(const Unit& unit, const Reading& reading) {
  std::string text;
  const auto add = [&text](const std::string& part) { text += text.empty() ? part : "   " + part; };
  if (reading.singleturn_bits != 0) add(position_text(reading));
  if (reading.multiturn_bits != 0) add(turns_text(reading));
  const FieldInfo* field = unit.alarms != nullptr ? unit.alarms : unit.status;
  const std::string flags = flags_text(field, unit.alarms != nullptr ? reading.alarms : reading.status);
  if (field != nullptr)
    add(flags.empty() ? fmt::format("no {}", field->name) : fmt::format("{}: {}", field->name, flags));
  return text;
}

std::string millimetres_text(double millimetres, double unit_um) {
  return fmt::format("{:.{}f}", millimetres, linear_decimals(unit_um));
}

std::string flags_in_words(const FieldInfo* field, std::uint32_t bits) {
  std::string lines;
  for (std::size_t i = 0; field != nullptr && i < field->flags.size(); ++i) {
    const FlagInfo& flag = field->flags[i];
    if ((bits >> i & 1) == 0 || flag.name.empty()) continue;
    if (!lines.empty()) lines += '\n';
    lines += fmt::format("  {}: {}", flag.name, flag.meaning);
    if (!flag.action.empty()) lines += fmt::format(". What to do: {}", flag.action);
  }
  return lines;
}

std::string alarms_in_words(const Unit& unit, const Reading& reading) {
  return flags_in_words(unit.alarms, reading.alarms);
}

void set_reading(Json& json, const Unit& unit, const Reading& reading, bool confirmed) {
  if (reading.singleturn_bits != 0) {
    const bool valid = reading.singleturn_valid() && reading.ready;
    const double um = micrometres(reading.singleturn, reading.unit_um);
    if (reading.unit_um > 0) {
      json.set("position_mm", valid ? Json(um / 1000) : Json()).set("position_um", valid ? Json(um) : Json());
    } else {
      json.set("angle_deg", valid ? Json(degrees(reading.singleturn, reading.singleturn_bits)) : Json());
    }
    json.set("singleturn", reading.singleturn).set("singleturn_bits", reading.singleturn_bits);
    json.set("singleturn_valid", valid).set("singleturn_valid_bits", reading.singleturn_valid_bits);
  }
  if (reading.multiturn_bits != 0) {
    json.set("multiturn", reading.multiturn).set("multiturn_bits", reading.multiturn_bits);
    json.set("multiturn_valid", reading.multiturn_valid);
  }
  if (unit.status != nullptr) json.set("status", flags_to_json(*unit.status, reading.status));
  if (unit.alarms != nullptr) json.set("alarms", flags_to_json(*unit.alarms, reading.alarms));
  json.set("confirmed", confirmed).set("ok", true);
}

Json to_json(const Unit& unit, const Reading& reading, double seconds, bool confirmed) {
  Json json = Json::object().set("time_s", seconds).set("protocol", unit.id);
  set_reading(json, unit, reading, confirmed);
  return json;
}

Reading checked(Reading reading, bool confirmed) {
  if (confirmed || !reading.ready || !reading.singleturn_valid()) return reading;
  reading.singleturn_valid_bits = 0;
  reading.multiturn_valid = false;
  return reading;
}

std::string to_csv(const Unit& unit, const Reading& reading, double seconds) {
  std::string row = fmt::format("{:.6f},", seconds);
  if (reading.singleturn_bits != 0) {
    const bool valid = reading.singleturn_valid() && reading.ready;
    const bool linear = reading.unit_um > 0;
    const double um = micrometres(reading.singleturn, reading.unit_um);
    if (valid && linear) row += fmt::format("{},{}", um / 1000, um);
    if (valid && !linear) row += fmt::format("{}", degrees(reading.singleturn, reading.singleturn_bits));
    if (!valid && linear) row += ",";
    row += fmt::format(",{},{}", reading.singleturn, valid);
  } else {
    row += ",,";
  }
  if (reading.multiturn_bits != 0) {
    row += fmt::format(",{},{}", reading.multiturn, reading.multiturn_valid);
  } else {
    row += ",,";
  }
  return row + fmt::format(",{},{}", flags_text(unit.status, reading.status), flags_text(unit.alarms, reading.alarms));
}

bool holds(const FieldInfo& field, const Reading& reading) {
  static constexpr std::array<std::string_view, 5> positions{"singleturn", "angle_deg", "position", "position_um",
                                                             "position_mm"};
  if (field.name == "multiturn") return reading.multiturn_bits == 0 || reading.multiturn_valid;
  const bool is_position = std::find(positions.begin(), positions.end(), field.name) != positions.end();
  return !is_position || reading.singleturn_bits == 0 || (reading.singleturn_valid() && reading.ready);
}

void set_validity(Json& json, const Reading& reading) {
  if (reading.singleturn_bits != 0) json.set("singleturn_valid", reading.singleturn_valid() && reading.ready);
  if (reading.multiturn_bits != 0) json.set("multiturn_valid", reading.multiturn_valid);
}

std::vector<std::string_view> FieldsWithReading::invalid() const {
  std::vector<std::string_view> names;
  for (const FieldInfo* info : names_) {
    if (reading_ && !holds(*info, *reading_)) names.push_back(info->name);
  }
  return names;
}

void mark_invalid(std::vector<std::vector<std::string>>& rows, std::span<const std::string_view> invalid) {
  for (std::vector<std::string>& row : rows) {
    const bool is_invalid = row.size() > 1 && std::find(invalid.begin(), invalid.end(), row[0]) != invalid.end();
    if (is_invalid) row[1] = fmt::format("INVALID ({})", row[1]);
  }
}

}  // namespace absenc::tool
