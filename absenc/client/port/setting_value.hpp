// SPDX-License-Identifier: Apache-2.0
// Values of settings behind an encoder. Each function throws UsageError, which says what the value must be.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Returns a whole number within these limits.
[[nodiscard]] std::int64_t number_of(const OptionText& setting, std::int64_t minimum, std::int64_t maximum);
/// Returns a number from -`most` to `most`, above 0 where `is_above_zero`.
[[nodiscard]] double real_of(const OptionText& setting, double most, bool is_above_zero);
/// Returns "100", "12.5" or "50/3" as a number; both parts are above 0 and up to a million.
[[nodiscard]] double ratio_of(const OptionText& setting);
/// Returns the index of one of the words.
[[nodiscard]] std::size_t choice_of(const OptionText& setting, std::initializer_list<std::string_view> words);

}  // namespace absenc::client
