// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/unit_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "absenc/client/error.hpp"
#include "absenc/client/text/known_name.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

namespace {

template <class Named>
std::vector<std::string_view> names_of(std::span<const Named> all) {
  std::vector<std::string_view> names;
  for (const Named& one : all) {
    if (!one.name.empty()) names.push_back(one.name);
  }
  return names;
}

std::string sentence(const Unit& unit, const OptionError& error, std::span<const std::string_view> extra_names) {
  switch (error.kind) {
    case OptionError::Kind::unknown_model:
      return fmt::format("{} has no model \"{}\"{}", unit.id, error.text,
                         suggestion(error.text, names_of(unit.models)));
    case OptionError::Kind::bad_value:
      return fmt::format("{} is \"{}\", but must be {}", error.option->name, error.text, range_of(*error.option));
    case OptionError::Kind::bad_word: {
      const std::string_view item = error.text.substr(0, error.text.find(' ', error.word.at)).substr(error.word.at);
      const std::string what = item.empty() ? "its end" : fmt::format("\"{}\"", item);
      return fmt::format("{} is \"{}\", where at character {}, {}: {}", word_option_name, error.text, error.word.at + 1,
                         what, error.word.reason);
    }
    case OptionError::Kind::beside_word:
      return fmt::format("{} cannot be given together with {}, which says it already", error.text, word_option_name);
    default:
      break;
  }
  std::vector<std::string_view> names = names_of(unit.options);
  if (takes_word(unit)) names.push_back(word_option_name);
  names.push_back("model");
  names.insert(names.end(), extra_names.begin(), extra_names.end());
  return fmt::format("{} has no option \"{}\"{}", unit.id, error.text, suggestion(error.text, names));
}

bool has(const Argument& argument, std::int64_t value) {
  return value >= argument.minimum && value <= argument.maximum;
}

template <class Given>
void require_few(const Command& command, std::span<const Given> given) {
  if (given.size() <= command.arguments.size()) return;
  const std::vector<std::string_view> names = names_of(command.arguments);
  throw UsageError(fmt::format("{} takes {}, so \"{}\" is too much", command.name,
                               names.empty() ? "no arguments" : fmt::format("only {}", fmt::join(names, ", ")),
                               given[command.arguments.size()]));
}

template <class Given>
[[noreturn]] void refuse(const Command& command, const Argument& argument, const Given& given) {
  throw UsageError(fmt::format("{} of {} is \"{}\", but must be a number from {} to {}", argument.name, command.name,
                               given, argument.minimum, argument.maximum));
}

}  // namespace

const Unit& require_unit(std::string_view id) {
  if (const Unit* unit = find_unit(id)) return *unit;
  if (const std::optional<KnownName> known = find_known_name(id)) {
    const Unit& first = *known->units.front();
    const bool is_default = !known->is_model || first.models.front().name == known->name;
    throw UsageError(fmt::format("{}: write {}{}; `absenc list {}` shows it", known->sentence(), first.id,
                                 is_default ? "" : fmt::format(" with model={}", known->name), first.id));
  }
  std::vector<std::string_view> names;
  for (const Unit* unit : all_units()) names.push_back(unit->id);
  throw UsageError(fmt::format("there is no protocol \"{}\"{}", id, suggestion(id, names)));
}

const Command& require_command(const Unit& unit, std::string_view name) {
  if (const Command* command = find_command(unit, name)) return *command;
  throw UsageError(fmt::format("{} has no command \"{}\"{}", unit.id, name, suggestion(name, names_of(unit.commands))));
}

OptionText split_setting(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    throw UsageError(fmt::format("\"{}\" is no setting: write NAME=VALUE", text));
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

Options require_options(const Unit& unit, std::string_view model, std::span<const OptionText> settings,
                        std::span<const std::string_view> extra_names) {
  std::vector<OptionText> own;
  for (const OptionText& setting : settings) {
    if (setting.name != "model") {
      own.push_back(setting);
    } else if (!model.empty() && model != setting.value) {
      throw UsageError(fmt::format("two models are given, {} and {}: give one", model, setting.value));
    } else {
      model = setting.value;
    }
  }
  Options options;
  const OptionError error = resolve_options(unit, model, own, options);
  if (error.kind != OptionError::Kind::none) throw UsageError(sentence(unit, error, extra_names));
  return options;
}

Options require_options(const Unit& unit, std::string_view model, std::span<const std::string> settings) {
  std::vector<OptionText> split;
  for (const std::string& setting : settings) split.push_back(split_setting(setting));
  return require_options(unit, model, split);
}

std::vector<std::int64_t> require_arguments(const Command& command, std::span<const std::string> written) {
  require_few(command, written);
  std::vector<std::int64_t> values;
  for (std::size_t i = 0; i < written.size(); ++i) {
    const Result<std::int64_t> value = parse_number(written[i]);
    const Argument& argument = command.arguments[i];
    if (!value || !has(argument, *value)) refuse(command, argument, written[i]);
    values.push_back(*value);
  }
  return complete_arguments(command, values);
}

std::vector<std::int64_t> complete_arguments(const Command& command, std::span<const std::int64_t> given) {
  require_few(command, given);
  std::vector<std::int64_t> values(given.begin(), given.end());
  for (std::size_t i = 0; i < command.arguments.size(); ++i) {
    const Argument& argument = command.arguments[i];
    if (i >= given.size()) {
      if (argument.required) {
        throw UsageError(fmt::format("{} needs the argument {}: {}", command.name, argument.name, argument.meaning));
      }
      values.push_back(argument.default_value);
    } else if (!has(argument, given[i])) {
      refuse(command, argument, given[i]);
    }
  }
  return values;
}

Options options_behind(const Unit& unit, const Options& options, const Command& setter, std::int64_t value) {
  Options changed = options;
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const Option& option = unit.options[i];
    if (option.name != setter.changes_option) continue;
    const std::string text = fmt::format("{}", value);
    const auto choice = std::find(option.choices.begin(), option.choices.end(), text);
    changed.values[i] = option.choices.empty() ? value : choice - option.choices.begin();
  }
  return changed;
}

std::int64_t role_value(const Command& command, std::span<const std::int64_t> arguments, Role role) {
  const Argument* const argument = find_role(command.arguments, role);
  return argument != nullptr ? arguments[static_cast<std::size_t>(argument - command.arguments.data())] : 0;
}

std::vector<std::int64_t> role_arguments(const Command& command, std::initializer_list<RoleArgument> values) {
  std::vector<std::int64_t> all;
  for (const Argument& argument : command.arguments) {
    const auto value =
        std::find_if(values.begin(), values.end(), [&](const RoleArgument& one) { return one.role == argument.role; });
    all.push_back(value != values.end() ? value->value : argument.default_value);
  }
  return all;
}

const Condition* find_condition(const Unit& unit, std::string_view name) {
  const auto found = std::find_if(unit.conditions.begin(), unit.conditions.end(),
                                  [&](const Condition& condition) { return condition.name == name; });
  return found == unit.conditions.end() ? nullptr : &*found;
}

const Condition& require_condition(const Unit& unit, std::string_view name) {
  if (const Condition* condition = find_condition(unit, name)) return *condition;
  if (unit.conditions.empty()) {
    throw UsageError(fmt::format("the virtual encoder of {} has no conditions to be set", unit.id));
  }
  throw UsageError(fmt::format("there is no condition \"{}\"{}", name, suggestion(name, names_of(unit.conditions))));
}

std::int64_t require_value(const Condition& condition, std::string_view written) {
  const Result<std::int64_t> value = parse_number(written);
  if (value && *value >= condition.minimum && *value <= condition.maximum) return *value;
  throw UsageError(
      fmt::format("{} is \"{}\", but must be a number from {}", condition.name, written, range_of(condition)));
}

std::string range_of(const Condition& condition) {
  return fmt::format("{} to {}", condition.minimum, to_text(condition, condition.maximum));
}

std::string to_text(const Condition& condition, std::int64_t value) {
  return fmt::format("{}{}{}", value, condition.unit.empty() ? "" : " ", condition.unit);
}

std::uint32_t require_alarms(const Unit& unit, std::span<const std::string> names) {
  if (unit.alarms == nullptr) throw UsageError(fmt::format("the encoders of {} have no alarms", unit.id));
  const FieldInfo& field = *unit.alarms;
  std::uint32_t bits = 0;
  for (const std::string& name : names) {
    std::size_t bit = 0;
    while (bit < field.flags.size() && field.flags[bit].name != name) ++bit;
    if (name.empty() || bit == field.flags.size()) {
      throw UsageError(fmt::format("there is no alarm \"{}\"{}", name, suggestion(name, names_of(field.flags))));
    }
    bits |= std::uint32_t{1} << bit;
  }
  return bits;
}

std::vector<std::string> reportable_alarms(const Unit& unit, const Options& options) {
  const std::uint64_t bits = unit.reportable != nullptr ? unit.reportable(options) : ~std::uint64_t{0};
  std::vector<std::string> names;
  if (unit.alarms == nullptr) return names;
  for (const std::string_view name : flag_names(*unit.alarms, bits)) names.emplace_back(name);
  return names;
}

std::uint32_t require_alarms(const Unit& unit, const Options& options, std::span<const std::string> names) {
  const std::uint32_t bits = require_alarms(unit, names);
  const std::vector<std::string> reportable = reportable_alarms(unit, options);
  for (const std::string& name : names) {
    if (std::find(reportable.begin(), reportable.end(), name) != reportable.end()) continue;
    throw UsageError(fmt::format(
        "the alarm {} cannot be shown: nothing in what {} sends with these options reports it; `absenc list {}` shows "
        "the options that add it",
        name, unit.id, unit.id));
  }
  return bits;
}

std::string range_of(const Option& option) {
  if (!option.choices.empty()) return fmt::format("{}", fmt::join(option.choices, " or "));
  const std::string ends = fmt::format("{}{} to {}", option.or_zero ? "0 or " : "", to_text(option, option.minimum),
                                       to_text(option, option.maximum));
  return option.step == 1 ? ends : fmt::format("{} in steps of {}", ends, to_text(option, option.step));
}

double real_value(const Option& option, std::int64_t value) {
  return static_cast<double>(value) / std::pow(10, option.decimals);
}

std::string to_text(const Option& option, std::int64_t value) {
  if (option.in_hex) return hexadecimal(value);
  if (option.choices.empty())
    return option.decimals == 0 ? fmt::format("{}", value) : fmt::format("{:#}", real_value(option, value));
  return std::string(option.choices[static_cast<std::size_t>(value)]);
}

std::string to_text(const WordFormat& word) {
  std::string text;
  for (const WordField& field : word.fields()) {
    const std::string_view meaning = meaning_names[static_cast<std::size_t>(field.meaning)];
    const std::string name = field.name == meaning ? "" : fmt::format("{}=", std::string_view(field.name));
    text += fmt::format("{}{}{}:{}{}", text.empty() ? "" : " ", name, meaning, field.bits, field.active_low ? "!" : "");
  }
  return word.gray() ? text + " gray" : text;
}

std::string option_text(const Unit& unit, const Options& options, std::string_view name) {
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const Option& option = unit.options[i];
    if (option.name == name) return fmt::format("{}={}", name, to_text(option, options[i]));
  }
  return {};
}

std::vector<std::string> option_texts(const Unit& unit, const Options& options) {
  std::vector<std::string> texts;
  if (options.has_word()) texts.push_back(fmt::format("{}={}", word_option_name, to_text(options.word)));
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    if (options.has_word() && unit.options[i].describes_word) continue;
    texts.push_back(fmt::format("{}={}", unit.options[i].name, to_text(unit.options[i], options[i])));
  }
  return texts;
}

std::vector<const FlagInfo*> raised(const FieldInfo& field, std::uint64_t bits) {
  std::vector<const FlagInfo*> flags;
  for (std::size_t i = 0; i < field.flags.size(); ++i) {
    if ((bits >> i & 1) != 0 && !field.flags[i].name.empty()) flags.push_back(&field.flags[i]);
  }
  return flags;
}

std::string_view action_of(const FlagInfo& flag, bool beside_alarms) {
  return beside_alarms && flag.sums != 0 ? std::string_view{} : flag.action;
}

std::vector<std::string_view> flag_names(const FieldInfo& field, std::uint64_t bits) {
  std::vector<std::string_view> names;
  for (const FlagInfo* flag : raised(field, bits)) names.push_back(flag->name);
  return names;
}

std::string to_text(const FieldValue& value) {
  switch (value.info->kind) {
    case FieldInfo::Kind::counts:
      return fmt::format("{}", static_cast<std::uint64_t>(value.number));
    case FieldInfo::Kind::boolean:
      return value.number != 0 ? "yes" : "no";
    case FieldInfo::Kind::flags: {
      const auto names = flag_names(*value.info, static_cast<std::uint64_t>(value.number));
      return names.empty() ? "none" : fmt::format("{}", fmt::join(names, " "));
    }
    case FieldInfo::Kind::real:
      return fmt::format("{}", value.real);
    case FieldInfo::Kind::text:
      return printable(value.bytes);
    case FieldInfo::Kind::bytes:
      return to_hex(value.bytes);
    case FieldInfo::Kind::number:
      break;
  }
  return value.info->in_hex ? hexadecimal(value.number) : fmt::format("{}", value.number);
}

std::string hexadecimal(std::int64_t value) {
  return value < 0 ? fmt::format("{}", value) : fmt::format("0x{:02X}", value);
}

Validity validity_of(const FieldInfo& field, const Reading& reading) {
  if (!is_of_reading(field.role)) return Validity::valid;
  const bool turns = field.role == Role::turns;
  if (!turns && reading.singleturn_bits != 0 && !reading.ready) return Validity::invalid;
  const Validity validity = turns ? reading.multiturn_validity() : reading.singleturn_validity();
  return validity == Validity::absent ? Validity::valid : validity;
}

bool holds(const FieldInfo& field, const Reading& reading) { return validity_of(field, reading) == Validity::valid; }

std::string marked(const FieldInfo& field, const std::string& value, const Reading& reading) {
  const Validity validity = validity_of(field, reading);
  if (validity == Validity::valid) return value;
  if (validity == Validity::unknown) return fmt::format("unknown ({})", value);
  if (!reading.ready) return fmt::format("INVALID ({}: the encoder is starting)", value);
  const unsigned valid = reading.singleturn_valid_bits;
  if (field.role == Role::turns || valid == 0) return fmt::format("INVALID ({})", value);
  return fmt::format("INVALID (only the top {} of {} bits hold: {})", valid, reading.singleturn_bits, value);
}

std::string life_of(const MemoryArea& area) {
  if (area.write_life == 0) return "";
  return fmt::format("{} {}", area.write_life, area.life_in_total ? "writes in total" : "writing cycles");
}

std::string_view name_of(LinkKind link) {
  static constexpr std::array<std::string_view, 6> names{"half_duplex", "full_duplex",           "exchange",
                                                         "clocked",     "clocked_bidirectional", "can"};
  return names[static_cast<std::size_t>(link)];
}

std::string rate_text(std::uint32_t bits_per_second) {
  const double rate = bits_per_second;
  if (bits_per_second >= 1'000'000) return fmt::format("{} Mbit/s", rate / 1e6);
  return fmt::format("{} kbit/s", rate / 1e3);
}

std::string line_of(const Unit& unit) { return line_of(unit.link, unit.line); }

std::string line_of(LinkKind link, const LineSettings& line) {
  static constexpr std::array<std::string_view, 6> words{
      "RS-485 half duplex", "full-duplex UART", "SPI", "clocked bits", "clocked bits in both directions", "CAN"};
  const std::string_view kind = words[static_cast<std::size_t>(link)];
  if (line.rate == 0) return fmt::format("{}, baud to be given", kind);
  return fmt::format("{}, {}", kind, rate_text(line.rate));
}

std::string printable(Bytes bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += byte >= 0x20 && byte < 0x7F ? static_cast<char>(byte) : '.';
  return text;
}

std::string to_text(Time time) {
  const auto nanoseconds = static_cast<double>(time.count());
  if (nanoseconds < 999.5) return fmt::format("{} ns", time.count());
  if (nanoseconds < 999.5e3) return fmt::format("{:.3g} us", nanoseconds / 1e3);
  if (nanoseconds < 999.5e6) return fmt::format("{:.3g} ms", nanoseconds / 1e6);
  return fmt::format("{:.4g} s", nanoseconds / 1e9);
}

std::string_view name_of(Role role) {
  static constexpr std::array<std::string_view, 23> names{"",
                                                          "position",
                                                          "turns",
                                                          "of_position",
                                                          "sequence",
                                                          "life_counter",
                                                          "encoder",
                                                          "identity",
                                                          "clash",
                                                          "trouble",
                                                          "rate",
                                                          "check_width",
                                                          "check_polynomial",
                                                          "check_init",
                                                          "check_inverted",
                                                          "address",
                                                          "page",
                                                          "count",
                                                          "force",
                                                          "value",
                                                          "data",
                                                          "written",
                                                          "exchange"};
  return names[static_cast<std::size_t>(role)];
}

std::string_view name_of(Verb verb) {
  static constexpr std::array<std::string_view, 13> names{
      "read",        "read_part",    "info",       "temperature", "clear_alarms", "zero", "reset_multiturn",
      "memory_read", "memory_write", "config_get", "config_set",  "scan",         "run"};
  return names[static_cast<std::size_t>(verb)];
}

}  // namespace absenc::client
