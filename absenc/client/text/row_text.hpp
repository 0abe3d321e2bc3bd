// SPDX-License-Identifier: Apache-2.0
// Rows as lines of a table with commas between, and as JSON.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/row.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::client {

/// The names of the columns, without details.
[[nodiscard]] std::string csv_header(std::span<const Column> columns);
/// The values under them; what is not told, or does not hold, is empty. Without its end.
void append_csv(std::string& text, const Row& row);
[[nodiscard]] std::string to_csv(const Row& row);

/// {"name":"over_heat","meaning":...,"action":...}
[[nodiscard]] Json flag_to_json(const FlagInfo* flag);
/// ["over_heat","battery_alarm"]
[[nodiscard]] Json flags_to_json(const FieldInfo& field, std::uint64_t bits);
[[nodiscard]] Json to_json(const Value& value);
/// What is not told is left out; what does not hold is null.
[[nodiscard]] Json to_json(const Row& row);

/// Returns the value of an option: a number, the name of a choice, or true and false.
[[nodiscard]] Json to_json(const Option& option, std::int64_t value);

}  // namespace absenc::client
