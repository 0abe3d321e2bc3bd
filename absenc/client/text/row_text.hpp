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

/// Returns the names of the columns as a CSV line, without columns that are details.
[[nodiscard]] std::string csv_header(std::span<const Column> columns);
/// Append or return the values of a row as a CSV line, without columns that are details.
void append_csv(std::string& text, const Row& row);
[[nodiscard]] std::string to_csv(const Row& row);

/// Returns a flag as a JSON object: {"name":"over_heat","meaning":...,"action":...}.
[[nodiscard]] Json flag_to_json(const FlagInfo* flag);
/// Returns the names of the flags in `bits` as a JSON array: ["over_heat","battery_alarm"].
[[nodiscard]] Json flags_to_json(const FieldInfo& field, std::uint64_t bits);
[[nodiscard]] Json to_json(const Value& value);
/// Returns the row as a JSON object without missing values; invalid and unknown ones are null.
[[nodiscard]] Json to_json(const Row& row);

/// Returns the value of an option as JSON: a number, the name of a choice, or a boolean.
[[nodiscard]] Json to_json(const Option& option, std::int64_t value);

}  // namespace absenc::client
