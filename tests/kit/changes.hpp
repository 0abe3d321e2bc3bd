// SPDX-License-Identifier: Apache-2.0
// Functions that check the effect of commands that change an encoder.
#pragma once

#include <algorithm>
#include <charconv>
#include <string>

#include "tests/kit/world.hpp"

namespace absenc::kit {

/// Returns the element of `values` for the command's argument with the given role; null if the command has none.
[[nodiscard]] inline std::int64_t* argument(const Command& command, Values& values, Role role) {
  const Argument* const found = find_role(command.arguments, role);
  return found != nullptr ? &values[static_cast<std::size_t>(found - command.arguments.data())] : nullptr;
}

[[nodiscard]] inline Values memory_arguments(const Command& command, const MemoryArea& area, std::uint32_t address,
                                             std::uint8_t byte) {
  Values values = least_arguments(command);
  const auto set = [&](Role role, std::int64_t value) {
    if (std::int64_t* one = argument(command, values, role)) *one = value;
  };
  set(Role::address, address);
  set(Role::page, area.page);
  set(Role::count, 1);
  set(Role::value, byte);
  set(Role::force, area.protection.empty() ? 0 : 1);
  return values;
}

/// Returns random arguments for the command; nothing for a command that writes memory, if no byte is writable.
[[nodiscard]] inline std::optional<Values> change_arguments(const Unit& unit, const Command& command,
                                                            sim::Random& random) {
  if (command.verb != Verb::memory_write) return random_arguments(command, random);
  std::vector<const MemoryArea*> open;
  for (const MemoryArea& area : unit.memory) {
    if (area.writable) open.push_back(&area);
  }
  if (open.empty()) return std::nullopt;
  const MemoryArea& area = *open[random.below(open.size())];
  const auto address = static_cast<std::uint32_t>(area.first + random.below(area.count));
  return memory_arguments(command, area, address, static_cast<std::uint8_t>(random.below(256)));
}

/// If a setting of the encoder changes an option (`changes_option`), sets this option also for the host.
template <class Item>
void apply_to_host(World<Item>& world, const Unit& unit, const Command& setter, Arguments arguments) {
  if (setter.changes_option.empty()) return;
  Options options = world.options();
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const Option& option = unit.options[i];
    if (option.name != setter.changes_option) continue;
    std::int64_t value = arguments[0];
    const std::string text = std::to_string(value);
    if (!option.choices.empty()) {
      value = std::find(option.choices.begin(), option.choices.end(), text) - option.choices.begin();
    }
    options.values[i] = value;
  }
  world.set_options(options);
}

/// Runs the command until it succeeds, four times at most: unsolicited frames of the encoder may interrupt it.
template <class Item>
ConversationResult run_repeated(World<Item>& world, const Command& command, Arguments arguments) {
  ConversationResult result = world.run(command, arguments);
  for (unsigned more = 0; more < 3 && result.made && !result.good(); ++more) {
    world.pass(std::chrono::microseconds(700));
    result = world.run(command, arguments);
  }
  return result;
}

/// Returns the fields reported by the `config get` command of the setting; no fields if there is no such command.
template <class Item>
ReportedFields read_setting(World<Item>& world, const Unit& unit, const Command& setter) {
  const Command* getter = find_command(unit, setter.reads_back);
  return getter == nullptr ? ReportedFields{} : run_repeated(world, *getter, least_arguments(*getter)).seen;
}

/// Returns whether any field in `seen` has the value `value`, as a number or as decimal text.
[[nodiscard]] inline bool shows(const ReportedFields& seen, std::int64_t value) {
  return std::any_of(seen.fields.begin(), seen.fields.end(), [&](const auto& field) {
    return field.second.number == value || field.second.bytes == std::to_string(value);
  });
}

/// Checks the effect of a command that reported success on an undamaged line. Returns in words how the encoder differs
/// from the effect that the command promises; "" if it does not differ.
template <class Item>
std::string broken_promise(World<Item>& world, const Unit& unit, const Command& command, Values values,
                           const ReportedFields& written) {
  const Command* read = find_command(unit, Verb::read);
  const auto position = [&] { return world.run(*read, least_arguments(*read)).seen.reading; };
  switch (command.verb) {
    case Verb::zero: {
      const std::optional<Reading> now = position();
      if (!now) return "no position can be read after it";
      const std::int64_t off = wrapped_difference(now->singleturn, 0, now->singleturn_bits);
      const std::int64_t near = std::int64_t{1} << (now->singleturn_bits - std::min(now->singleturn_bits, 10u));
      return std::abs(off) <= near ? "" : "the position is " + std::to_string(off) + " counts off";
    }
    case Verb::reset_multiturn: {
      const std::optional<Reading> now = position();
      if (!now) return "no position can be read after it";
      const auto wanted = static_cast<std::uint64_t>(values.empty() ? 0 : values[0]) & low_mask(now->multiturn_bits);
      return now->multiturn == wanted ? "" : "the turns are " + std::to_string(now->multiturn);
    }
    case Verb::clear_alarms: {
      const std::optional<Reading> now = position();
      return now && now->alarms == 0 ? "" : "alarms are still raised";
    }
    case Verb::memory_write: {
      const Command* reader = find_command(unit, Verb::memory_read);
      if (reader == nullptr) return {};
      Values read_arguments = least_arguments(*reader);
      for (const Role role : {Role::address, Role::page}) {
        if (std::int64_t* one = argument(*reader, read_arguments, role)) *one = *argument(command, values, role);
      }
      const ConversationResult now = world.run(*reader, read_arguments);
      if (!now.good()) return "it cannot be read: " + std::string(text_of(now.error).name);
      const std::int64_t byte = *argument(command, values, Role::value);
      const bool is = std::any_of(now.seen.fields.begin(), now.seen.fields.end(), [&](const auto& field) {
        const Value& value = field.second;
        return (value.role == Role::data && value.bytes == std::string(1, static_cast<char>(byte))) ||
               (value.role == Role::value && value.number == byte);
      });
      return is ? "" : "the byte is " + to_text(now.seen.fields);
    }
    case Verb::config_set: {
      const ReportedFields now = read_setting(world, unit, command);
      if (!command.reads_back.empty() && now.fields.empty()) return "it cannot be read";
      for (const auto& [name, value] : now.fields) {
        // Two kinds of fields are not compared: repeated ones, which are from several frames, and the position, which
        // depends on the shaft.
        if (name.find('#') != std::string::npos || is_of_reading(value.role)) continue;
        const auto found = written.fields.find(name);
        if (found != written.fields.end() && !(found->second == value)) return name + " reads differently";
      }
      // A text instead of a number in the setting's field means that the encoder cannot report the setting.
      const auto setting = now.fields.find(std::string(command.reads_back));
      const bool in_words = setting != now.fields.end() && !setting->second.bytes.empty();
      if (!now.fields.empty() && !values.empty() && !in_words && !shows(now, values[0])) {
        return "the value read back does not contain it: " + to_text(now.fields);
      }
      return {};
    }
    default:
      return {};
  }
}

}  // namespace absenc::kit
