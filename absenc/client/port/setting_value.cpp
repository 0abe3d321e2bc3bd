// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/setting_value.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "absenc/client/error.hpp"
#include "absenc/client/text/real_number.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

namespace {

// Parses a real number. `text` is the value of the setting, or a part of that value.
double real_in(const OptionText& setting, std::string_view text, double most, bool is_above_zero) {
  const std::optional<double> value = parse_real(text);
  if (value && std::abs(*value) <= most && (!is_above_zero || *value > 0)) return *value;
  throw UsageError(fmt::format("{} is \"{}\", but must be a number {} up to {}", setting.name, setting.value,
                               is_above_zero ? "above 0" : fmt::format("from {}", -most), most));
}

}  // namespace

std::int64_t number_of(const OptionText& setting, std::int64_t minimum, std::int64_t maximum) {
  const Result<std::int64_t> number = parse_number(setting.value);
  if (number && *number >= minimum && *number <= maximum) return *number;
  throw UsageError(fmt::format("{} is \"{}\", but must be a whole number from {} to {}", setting.name, setting.value,
                               minimum, maximum));
}

double real_of(const OptionText& setting, double most, bool is_above_zero) {
  return real_in(setting, setting.value, most, is_above_zero);
}

double ratio_of(const OptionText& setting) {
  constexpr double most = 1e6;
  const std::size_t slash = setting.value.find('/');
  const double above = real_in(setting, setting.value.substr(0, slash), most, true);
  if (slash == std::string_view::npos) return above;
  return above / real_in(setting, setting.value.substr(slash + 1), most, true);
}

std::size_t choice_of(const OptionText& setting, std::span<const std::string_view> words) {
  const auto found = std::find(words.begin(), words.end(), setting.value);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  throw UsageError(fmt::format("{} is \"{}\", but must be {} or {}", setting.name, setting.value,
                               fmt::join(words.first(words.size() - 1), ", "), words.back()));
}

}  // namespace absenc::client
