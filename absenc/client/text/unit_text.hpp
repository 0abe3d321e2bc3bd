// SPDX-License-Identifier: Apache-2.0
// Converts between the text of users and a unit's descriptor: units, options, commands and fields by their names.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Returns the unit of this name. Throws UsageError, which names the protocols of a maker or model, or else the
/// nearest.
[[nodiscard]] const Unit& require_unit(std::string_view id);
[[nodiscard]] const Command& require_command(const Unit& unit, std::string_view name);

/// Parses "name=value". Throws UsageError.
[[nodiscard]] OptionText split_setting(std::string_view text);

/// Returns the options of a model changed by settings; "model" may be one of them. For an unknown name, the error also
/// suggests `extra_names`. Throws UsageError.
[[nodiscard]] Options require_options(const Unit& unit, std::string_view model, std::span<const OptionText> settings,
                                      std::span<const std::string_view> extra_names = {});
/// Returns the options given by --option and --model.
[[nodiscard]] Options require_options(const Unit& unit, std::string_view model, std::span<const std::string> settings);

/// Parses the arguments of the command, one value for each. Throws UsageError.
[[nodiscard]] std::vector<std::int64_t> require_arguments(const Command& command, std::span<const std::string> written);

/// Checks numbers as arguments of the command; adds defaults for those that are left out. Throws UsageError.
[[nodiscard]] std::vector<std::int64_t> complete_arguments(const Command& command, std::span<const std::int64_t> given);

/// Returns the options with which the encoder is reached after this setting was set to `value`.
[[nodiscard]] Options options_behind(const Unit& unit, const Options& options, const Command& setter,
                                     std::int64_t value);

struct RoleArgument {
  Role role;
  std::int64_t value;
};
/// Returns arguments in the order of the command, from values by role; roles without a value get their default.
[[nodiscard]] std::vector<std::int64_t> role_arguments(const Command& command,
                                                       std::initializer_list<RoleArgument> values);

/// Returns the argument with this role; 0 if the command has none.
[[nodiscard]] std::int64_t role_value(const Command& command, std::span<const std::int64_t> arguments, Role role);

/// Returns the bits of the flags with these names. Throws UsageError.
[[nodiscard]] std::uint32_t require_alarms(const Unit& unit, std::span<const std::string> names);
/// Returns the names of the flags that an encoder with these options can report.
[[nodiscard]] std::vector<std::string> reportable_alarms(const Unit& unit, const Options& options);
/// Returns the bits of named flags; the encoder with these options must be able to report them. Throws UsageError.
[[nodiscard]] std::uint32_t require_alarms(const Unit& unit, const Options& options,
                                           std::span<const std::string> names);

/// Returns the condition of this name; null if the virtual encoder has none.
[[nodiscard]] const Condition* find_condition(const Unit& unit, std::string_view name);
/// Returns the condition of this name. Throws UsageError, which names the nearest.
[[nodiscard]] const Condition& require_condition(const Unit& unit, std::string_view name);
/// Throws UsageError.
[[nodiscard]] std::int64_t require_value(const Condition& condition, std::string_view written);
/// Returns a range as "-20 to 127 degC".
[[nodiscard]] std::string range_of(const Condition& condition);
/// Returns a value as "85 degC".
[[nodiscard]] std::string to_text(const Condition& condition, std::int64_t value);

/// Returns a time as "85 us", "2.1 ms" or "1.5 s".
[[nodiscard]] std::string to_text(Time time);

/// Returns the values of an option as "1 to 24" or "true, false".
[[nodiscard]] std::string range_of(const Option& option);
[[nodiscard]] std::string to_text(const Option& option, std::int64_t value);
/// Returns an option with decimals as the number that the user writes.
[[nodiscard]] double real_value(const Option& option, std::int64_t value);

/// Returns the rate as a setting, "baud=57600"; "" if the unit has no such option.
[[nodiscard]] std::string option_text(const Unit& unit, const Options& options, std::string_view name);

/// Returns a position word as text: "multiturn:12 position:24 gray".
[[nodiscard]] std::string to_text(const WordFormat& word);
/// Returns "name=value" for each option that has an effect; a position word replaces the options that it covers.
[[nodiscard]] std::vector<std::string> option_texts(const Unit& unit, const Options& options);

/// Returns the named flags that are set in `bits`.
[[nodiscard]] std::vector<const FlagInfo*> raised(const FieldInfo& field, std::uint64_t bits);
/// Returns what to do about a flag; also "" if the alarms shown beside it have that advice.
[[nodiscard]] std::string_view action_of(const FlagInfo& flag, bool beside_alarms);
[[nodiscard]] std::vector<std::string_view> flag_names(const FieldInfo& field, std::uint64_t bits);
[[nodiscard]] std::string to_text(const FieldValue& value);
/// Returns "0x17"; a negative number in decimal, because options use it for "any".
[[nodiscard]] std::string hexadecimal(std::int64_t value);
/// Returns an encoder's text with '.' for every character that is not printable ASCII.
[[nodiscard]] std::string printable(Bytes bytes);

/// Returns "100000 writes in total", or "1000000 writing cycles" if the document does not say what it counts; "" if
/// unknown.
[[nodiscard]] std::string life_of(const MemoryArea& area);

/// Returns the name of the kind of line: "half_duplex".
[[nodiscard]] std::string_view name_of(LinkKind link);
/// Returns a rate as "2.5 Mbit/s" or "9.6 kbit/s".
[[nodiscard]] std::string rate_text(std::uint32_t bits_per_second);
/// Returns a line as "RS-485 half duplex, 2.5 Mbit/s".
[[nodiscard]] std::string line_of(const Unit& unit);
[[nodiscard]] std::string line_of(LinkKind link, const LineSettings& line);
[[nodiscard]] std::string_view name_of(Verb verb);
/// Returns the name of a role: "identity"; "" for `other`.
[[nodiscard]] std::string_view name_of(Role role);

/// Returns the validity of a field of the position, by the reading of the same frame; other fields are `valid`. All
/// output of fields uses this rule.
[[nodiscard]] Validity validity_of(const FieldInfo& field, const Reading& reading);
[[nodiscard]] bool holds(const FieldInfo& field, const Reading& reading);
/// Returns the value of such a field: "74565 counts", "INVALID (74565 counts)" or "unknown (74565 counts)".
[[nodiscard]] std::string marked(const FieldInfo& field, const std::string& value, const Reading& reading);

}  // namespace absenc::client
