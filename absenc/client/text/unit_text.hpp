// SPDX-License-Identifier: Apache-2.0
// Finds parts of units by their names, and returns values as text.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Returns the unit of this name. Throws UsageError, with a suggestion, if there is none.
[[nodiscard]] const Unit& require_unit(std::string_view id);
[[nodiscard]] const Command& require_command(const Unit& unit, std::string_view name);

/// Splits a setting "name=value" into name and value. Throws UsageError.
[[nodiscard]] OptionText split_setting(std::string_view text);

/// Returns the options of a model, changed by settings. Throws UsageError.
[[nodiscard]] Options require_options(const Unit& unit, std::string_view model, std::span<const OptionText> settings,
                                      std::span<const std::string_view> extra_names = {});
/// Returns the options of a model, changed by settings "name=value". Throws UsageError.
[[nodiscard]] Options require_options(const Unit& unit, std::string_view model, std::span<const std::string> settings);

/// Parses the arguments of a command, and adds defaults for missing ones. Throws UsageError.
[[nodiscard]] std::vector<std::int64_t> require_arguments(const Command& command, std::span<const std::string> written);

/// Returns the given arguments, and defaults for missing ones. Throws UsageError.
[[nodiscard]] std::vector<std::int64_t> complete_arguments(const Command& command, std::span<const std::int64_t> given);

/// Returns `options` as they are after a command that sets one of them to `value`.
[[nodiscard]] Options options_behind(const Unit& unit, const Options& options, const Command& setter,
                                     std::int64_t value);

struct RoleArgument {
  Role role;
  std::int64_t value;
};
/// Returns the arguments of the command. An argument whose role is in `values` gets the value given there, every other
/// one its default.
[[nodiscard]] std::vector<std::int64_t> role_arguments(const Command& command,
                                                       std::initializer_list<RoleArgument> values);

/// Returns the value of the argument with this role; 0 if the command has no such argument.
[[nodiscard]] std::int64_t role_value(const Command& command, std::span<const std::int64_t> arguments, Role role);

/// Returns the bits of the alarms with these names. Throws UsageError.
[[nodiscard]] std::uint32_t require_alarms(const Unit& unit, std::span<const std::string> names);
/// Returns the names of the alarms that an encoder with these options can report.
[[nodiscard]] std::vector<std::string> reportable_alarms(const Unit& unit, const Options& options);
/// Returns the bits of the alarms with these names. Throws UsageError also if one cannot be reported.
[[nodiscard]] std::uint32_t require_alarms(const Unit& unit, const Options& options,
                                           std::span<const std::string> names);

/// Returns the unit's condition of this name; null if the virtual encoder has no such condition.
[[nodiscard]] const Condition* find_condition(const Unit& unit, std::string_view name);
/// Returns the unit's condition of this name. Throws UsageError if there is none.
[[nodiscard]] const Condition& require_condition(const Unit& unit, std::string_view name);
/// Parses a value of a condition, which must be in its range. Throws UsageError.
[[nodiscard]] std::int64_t require_value(const Condition& condition, std::string_view written);
/// Returns the range of a condition as text: "-20 to 127 degC".
[[nodiscard]] std::string range_of(const Condition& condition);
/// Returns a value of a condition as text with its unit: "85 degC".
[[nodiscard]] std::string to_text(const Condition& condition, std::int64_t value);

/// Returns a time as text with a suitable unit: "85 us", "2.1 ms" or "1.5 s".
[[nodiscard]] std::string to_text(Time time);

/// Returns the possible values of an option as text, as "1 to 24" or "none or odd or even".
[[nodiscard]] std::string range_of(const Option& option);
[[nodiscard]] std::string to_text(const Option& option, std::int64_t value);
/// Returns the real number that an option stores as the integer `value`: `value` divided by 10^decimals of the option.
[[nodiscard]] double real_value(const Option& option, std::int64_t value);

/// Returns the option `name` with its value as a setting, as "baud=57600"; "" if the unit has no such option.
[[nodiscard]] std::string option_text(const Unit& unit, const Options& options, std::string_view name);

/// Returns the description of a position word as text: "multiturn:12 position:24 gray".
[[nodiscard]] std::string to_text(const WordFormat& word);
/// Returns the options as settings "name=value". If the position word is set as a whole, its setting replaces the
/// options that it contains.
[[nodiscard]] std::vector<std::string> option_texts(const Unit& unit, const Options& options);

/// Returns the flags of the field that have a name and are set in `bits`.
[[nodiscard]] std::vector<const FlagInfo*> raised(const FieldInfo& field, std::uint64_t bits);
/// Returns the advice on what to do about a flag; "" if `beside_alarms` says that the alarms are shown too and the flag
/// only sums these up.
[[nodiscard]] std::string_view action_of(const FlagInfo& flag, bool beside_alarms);
[[nodiscard]] std::vector<std::string_view> flag_names(const FieldInfo& field, std::uint64_t bits);
[[nodiscard]] std::string to_text(const FieldValue& value);
/// Returns the number in hexadecimal, "0x17"; a negative number in decimal.
[[nodiscard]] std::string hexadecimal(std::int64_t value);
/// Returns bytes as text, with '.' for bytes that are not printable ASCII.
[[nodiscard]] std::string printable(Bytes bytes);

/// Returns the endurance of a memory as text, as "100000 writes in total"; "" if unknown.
[[nodiscard]] std::string life_of(const MemoryArea& area);

/// Returns the name of a kind of line, as "half_duplex".
[[nodiscard]] std::string_view name_of(LinkKind link);
/// Returns a rate as text: "2.5 Mbit/s" or "9.6 kbit/s".
[[nodiscard]] std::string rate_text(std::uint32_t bits_per_second);
/// Returns the unit's usual line as text: "RS-485 half duplex, 2.5 Mbit/s".
[[nodiscard]] std::string line_of(const Unit& unit);
[[nodiscard]] std::string line_of(LinkKind link, const LineSettings& line);
[[nodiscard]] std::string_view name_of(Verb verb);
/// Returns the name of a role, as "identity"; "" for `other`.
[[nodiscard]] std::string_view name_of(Role role);

/// Returns the validity of a field in a reading; `valid` for fields other than position and turns.
[[nodiscard]] Validity validity_of(const FieldInfo& field, const Reading& reading);
[[nodiscard]] bool holds(const FieldInfo& field, const Reading& reading);
/// Returns a field's value as text, marked if it is not valid: "unknown (74565 counts)" or "INVALID (74565 counts)".
[[nodiscard]] std::string marked(const FieldInfo& field, const std::string& value, const Reading& reading);

}  // namespace absenc::client
