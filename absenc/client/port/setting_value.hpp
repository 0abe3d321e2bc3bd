// SPDX-License-Identifier: Apache-2.0
// Parses values of an encoder's settings. Each function throws UsageError.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Returns the setting's value as a whole number from `minimum` to `maximum`.
[[nodiscard]] std::int64_t number_of(const OptionText& setting, std::int64_t minimum, std::int64_t maximum);
/// Returns the setting's value as a number from -`most` to `most`; with `is_above_zero`, the number must be above 0.
[[nodiscard]] double real_of(const OptionText& setting, double most, bool is_above_zero);
/// Parses the setting's value as a ratio, such as "12.5" or "50/3".
[[nodiscard]] double ratio_of(const OptionText& setting);
/// Returns the index of the word that equals the setting's value.
[[nodiscard]] std::size_t choice_of(const OptionText& setting, std::span<const std::string_view> words);
[[nodiscard]] inline std::size_t choice_of(const OptionText& setting, std::initializer_list<std::string_view> words) {
  return choice_of(setting, std::span(words.begin(), words.size()));
}

}  // namespace absenc::client
