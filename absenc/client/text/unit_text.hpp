// SPDX-License-Identifier: Apache-2.0
// Between what a user writes or reads and a unit's descriptor: units, options, commands and fields by their names.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Throws UsageError, which names the protocols of a maker or model, or else the nearest.
[[nodiscard]] const Unit& require_unit(std::string_view id);
[[nodiscard]] const Command& require_command(const Unit& unit, std::string_view name);

/// "name=value"; throws UsageError.
[[nodiscard]] OptionText split_setting(std::string_view text);

/// The options of a model with single settings; "model" may be among the settings. `extra_names` are proposed beside
/// the unit's own when a name is unknown. Throws UsageError.
[[nodiscard]] Options require_options(const Unit& unit, std::string_view model, std::span<const OptionText> settings,
                                      std::span<const std::string_view> extra_names = {});
/// From --option and --model as they were written.
[[nodiscard]] Options require_options(const Unit& unit, std::string_view model, std::span<const std::string> settings);

/// One value for each argument of the command. Throws UsageError.
[[nodiscard]] std::vector<std::int64_t> require_arguments(const Command& command, std::span<const std::string> written);

/// The same of numbers; those that are left out have their defaults. Throws UsageError.
[[nodiscard]] std::vector<std::int64_t> complete_arguments(const Command& command, std::span<const std::int64_t> given);

/// The options that reach an encoder from now on when this setting was given `value`.
[[nodiscard]] Options options_behind(const Unit& unit, const Options& options, const Command& setter,
                                     std::int64_t value);

struct RoleArgument {
  Role role;
  std::int64_t value;
};
/// In the order of the command, which need not have all of them; the others get their defaults.
[[nodiscard]] std::vector<std::int64_t> role_arguments(const Command& command,
                                                       std::initializer_list<RoleArgument> values);

/// The argument with this role; 0 when the command has none.
[[nodiscard]] std::int64_t role_value(const Command& command, std::span<const std::int64_t> arguments, Role role);

/// The bits of the flags with these names. Throws UsageError.
[[nodiscard]] std::uint32_t require_alarms(const Unit& unit, std::span<const std::string> names);
/// Names of those that an encoder with these options can report.
[[nodiscard]] std::vector<std::string> reportable_alarms(const Unit& unit, const Options& options);
/// The same of an encoder with these options, which must be able to report them.
[[nodiscard]] std::uint32_t require_alarms(const Unit& unit, const Options& options,
                                           std::span<const std::string> names);

/// Null when the virtual encoder has no condition of this name.
[[nodiscard]] const Condition* find_condition(const Unit& unit, std::string_view name);
/// Throws UsageError, which names the nearest.
[[nodiscard]] const Condition& require_condition(const Unit& unit, std::string_view name);
/// Throws UsageError.
[[nodiscard]] std::int64_t require_value(const Condition& condition, std::string_view written);
/// "-20 to 127 degC"
[[nodiscard]] std::string range_of(const Condition& condition);
/// "85 degC"
[[nodiscard]] std::string to_text(const Condition& condition, std::int64_t value);

/// "85 us", "2.1 ms", "1.5 s"
[[nodiscard]] std::string to_text(Time time);

/// "1 to 24" or "true, false"
[[nodiscard]] std::string range_of(const Option& option);
[[nodiscard]] std::string to_text(const Option& option, std::int64_t value);
/// Of an option with decimals: the number that the user writes.
[[nodiscard]] double real_value(const Option& option, std::int64_t value);

/// "baud=57600", as it stands behind an encoder; "" when the unit has no such option.
[[nodiscard]] std::string option_text(const Unit& unit, const Options& options, std::string_view name);

/// As it was written, or would be: "multiturn:12 position:24 gray"
[[nodiscard]] std::string to_text(const WordFormat& word);
/// "name=value" of each that counts; a word in place of those that it stands in for.
[[nodiscard]] std::vector<std::string> option_texts(const Unit& unit, const Options& options);

/// Those that are set in `bits` and have a name.
[[nodiscard]] std::vector<const FlagInfo*> raised(const FieldInfo& field, std::uint64_t bits);
/// Returns what to do about a flag; "" also where the alarms, which are shown beside it, say it.
[[nodiscard]] std::string_view action_of(const FlagInfo& flag, bool beside_alarms);
[[nodiscard]] std::vector<std::string_view> flag_names(const FieldInfo& field, std::uint64_t bits);
[[nodiscard]] std::string to_text(const FieldValue& value);
/// "0x17"; below zero decimal, as options say "any".
[[nodiscard]] std::string hexadecimal(std::int64_t value);
/// Text of an encoder as it can be shown: what is no ASCII is a point.
[[nodiscard]] std::string printable(Bytes bytes);

/// "100000 writes in total", "1000000 writing cycles" where the document does not say of what; "": not known
[[nodiscard]] std::string life_of(const MemoryArea& area);

/// "half_duplex"
[[nodiscard]] std::string_view name_of(LinkKind link);
/// "2.5 Mbit/s", "9.6 kbit/s"
[[nodiscard]] std::string rate_text(std::uint32_t bits_per_second);
/// "RS-485 half duplex, 2.5 Mbit/s"
[[nodiscard]] std::string line_of(const Unit& unit);
[[nodiscard]] std::string line_of(LinkKind link, const LineSettings& line);
[[nodiscard]] std::string_view name_of(Verb verb);
/// "identity"; empty for `other`.
[[nodiscard]] std::string_view name_of(Role role);

/// Whether what this field shows of the position holds, by the reading of the same frame; what is no part of it is
/// `valid`. The one rule for all that shows fields.
[[nodiscard]] Validity validity_of(const FieldInfo& field, const Reading& reading);
[[nodiscard]] bool holds(const FieldInfo& field, const Reading& reading);
/// The value of such a field: as it is, "INVALID (74565 counts)", or "unknown (74565 counts)".
[[nodiscard]] std::string marked(const FieldInfo& field, const std::string& value, const Reading& reading);

}  // namespace absenc::client
