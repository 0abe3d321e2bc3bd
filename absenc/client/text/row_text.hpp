// SPDX-License-Identifier: Apache-2.0
// Prints rows as CSV lines and as JSON.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/row.hpp"
#include "absenc/client/text/json.hpp"

namespace absenc::client {

/// Returns the CSV line with the names of the columns, without details.
[[nodiscard]] std::string csv_header(std::span<const Column> columns);
/// Returns the CSV line of the values, without a line end. A missing or invalid value is empty.
void append_csv(std::string& text, const Row& row);
[[nodiscard]] std::string to_csv(const Row& row);

/// Returns {"name":"over_heat","meaning":...,"action":...}.
[[nodiscard]] Json flag_to_json(const FlagInfo* flag);
/// Returns ["over_heat","battery_alarm"].
[[nodiscard]] Json flags_to_json(const FieldInfo& field, std::uint64_t bits);
[[nodiscard]] Json to_json(const Value& value);
/// Returns the row as a JSON object. A missing value is left out, an invalid one is null.
[[nodiscard]] Json to_json(const Row& row);

/// Returns the value of an option: a number, the name of a choice, or a boolean.
[[nodiscard]] Json to_json(const Option& option, std::int64_t value);

}  // namespace absenc::client
