// SPDX-License-Identifier: Apache-2.0
// `config get` and `config set`: the settings that a protocol has commands for.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/consent.hpp"
#include "tools/absenc/encoder_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/field_text.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/run.hpp"

namespace absenc::tool {

namespace {

using Rows = std::vector<std::vector<std::string>>;

/// The fields of a setting, for people and for programs.
struct Setting final : FieldSink {
  void put(const FieldValue& value) override {
    shown.put(value);
    json.put(value);
  }
  [[nodiscard]] const std::string& text(const std::string& field) const {
    static const std::string none = "-";
    const auto row =
        std::find_if(shown.rows.begin(), shown.rows.end(), [&](const auto& one) { return one[0] == field; });
    return row != shown.rows.end() ? (*row)[1] : none;
  }
  FieldTable shown;
  JsonFields json;
};

std::vector<const Command*> all_settings(const Unit& unit) {
  std::vector<const Command*> settings;
  for (const Command& command : unit.commands) {
    if (command.verb == Verb::config_get) settings.push_back(&command);
  }
  if (settings.empty()) throw UsageError(fmt::format("{} has no settings", unit.id));
  return settings;
}

const Command& require_setting(const Unit& unit, std::string_view name) {
  std::vector<std::string_view> names;
  for (const Command* setting : all_settings(unit)) {
    if (setting->name == name) return *setting;
    names.push_back(setting->name);
  }
  throw UsageError(fmt::format("{} has no setting \"{}\"{}", unit.id, name, suggestion(name, names)));
}

const Command& require_setter(const Unit& unit, const Command& setting) {
  for (const Command& command : unit.commands) {
    if (command.verb == Verb::config_set && command.reads_back == setting.name) return command;
  }
  throw UsageError(fmt::format("{} of {} can only be read", setting.name, unit.id));
}

/// What `config set` changes, and how it is read: null when no command reads it.
struct Change {
  const Command* setter;
  const Command* getter;
};

Change require_change(const Unit& unit, std::string_view name) {
  for (const Command& command : unit.commands) {
    if (command.verb == Verb::config_set && command.reads_back.empty() && command.name == name) {
      return {&command, nullptr};
    }
  }
  const Command& getter = require_setting(unit, name);
  return {&require_setter(unit, getter), &getter};
}

// What the encoder is left with when the port is lost in the middle.
void write_setting(Connection& encoder, const Command& setter, Arguments values, FieldSink& written) {
  try {
    run_into(encoder, setter, values, written);
  } catch (const os::Failure& failure) {
    FieldTable left;
    encoder.report_left(left);
    if (left.rows.empty()) throw;
    throw Failure(fmt::format("{}\n{} was written, but what became of it could not be seen:\n{}", failure.what(),
                              setter.name, table(left.rows)));
  }
}

int run_get(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  std::vector<const Command*> settings = all_settings(*uri.unit);
  if (invocation.has("name")) settings = {&require_setting(*uri.unit, invocation.text("name"))};

  const std::unique_ptr<Connection> encoder = open_connection(uri);
  Rows rows{{"SETTING", "FIELD", "VALUE", ""}};
  Json all = Json::object();
  for (const Command* command : settings) {
    Setting setting;
    run_into(*encoder, *command, {}, setting);
    all.set(command->name, setting.json.fields);
    std::string name(command->name);
    for (auto& row : setting.shown.rows) {
      row.insert(row.begin(), std::exchange(name, ""));
      rows.push_back(row);
    }
  }
  print_line(invocation.has("--json") ? Json::object().set("ok", true).set("settings", all).line() : table(rows));
  return exit_good;
}

// The setter has read back what it wrote; this is what the encoder says when it is asked anew.
void require_same(const Setting& now, const Setting& written, std::string_view name) {
  for (const auto& row : written.shown.rows) {
    const std::string& value = now.text(row[0]);
    if (value == "-" || value == row[1]) continue;
    throw Failure(fmt::format("{} was written, but {} reads as {} instead of {}", name, row[0], value, row[1]));
  }
}

void show_change(std::string_view name, const Setting& old, const Setting& now) {
  Rows rows{{"SETTING", "FIELD", "WAS", "IS"}};
  std::string first(name);
  const auto add = [&](const std::string& field) {
    rows.push_back({std::exchange(first, ""), field, old.text(field), now.text(field)});
  };
  for (const auto& row : now.shown.rows) add(row[0]);
  for (const auto& row : old.shown.rows) {
    if (now.text(row[0]) == "-") add(row[0]);
  }
  print_line(table(rows));
}

// With --force the setter's argument of that role is 1.
std::vector<std::int64_t> setter_arguments(const Invocation& invocation, const Unit& unit, const Command& setter) {
  std::vector<std::int64_t> values = require_arguments(setter, invocation.texts("values"));
  if (!invocation.has("--force")) return values;
  const Argument* force = find_role(setter.arguments, Role::force);
  if (force == nullptr) throw UsageError(fmt::format("{} of {} knows no --force", setter.name, unit.id));
  values[static_cast<std::size_t>(force - setter.arguments.data())] = 1;
  return values;
}

// What the encoder was set to may be what it is reached with.
void follow(Connection& encoder, const Command& setter, std::int64_t value) {
  const std::span<const Option> options = encoder.unit().options;
  const auto option = std::find_if(options.begin(), options.end(),
                                   [&](const Option& one) { return one.name == setter.changes_option; });
  if (option == options.end()) return;
  const std::string text = fmt::format("{}", value);
  if (!option->choices.empty()) {
    value = std::find(option->choices.begin(), option->choices.end(), text) - option->choices.begin();
  }
  Options changed = encoder.uri().options;
  std::int64_t& present = changed.values[static_cast<std::size_t>(option - options.begin())];
  if (std::exchange(present, value) == value) return;
  encoder.set_options(changed);
  print_message(fmt::format("note: from now on it is reached with {}={}", option->name, text));
}

int run_set(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  const auto [setter, getter] = require_change(*uri.unit, invocation.text("name"));
  const std::string_view name = getter != nullptr ? getter->name : setter->name;
  const std::vector<std::int64_t> values = setter_arguments(invocation, *uri.unit, *setter);
  const bool asks = must_ask(invocation, uri, name, setter->meaning);

  const std::unique_ptr<Connection> encoder = open_connection(uri);
  Setting old, written, now;
  if (getter != nullptr) run_into(*encoder, *getter, {}, old);
  if (asks) {
    std::string is;
    for (const auto& row : old.shown.rows) is += fmt::format("{}{} is {}", is.empty() ? "" : ", ", row[0], row[1]);
    if (getter == nullptr) is = "what it is now cannot be read";
    if (!confirmed(uri, fmt::format("{} ({})", setter->meaning, is))) {
      print_message("nothing was changed");
      return exit_failed;
    }
  }
  try {
    write_setting(*encoder, *setter, values, written);
    follow(*encoder, *setter, values.front());
    if (getter != nullptr) run_into(*encoder, *getter, {}, now);
  } catch (const os::Interrupted&) {
    throw Failure(getter != nullptr ? fmt::format("interrupted: `absenc config get` says what {} is now", name)
                                    : fmt::format("interrupted: whether {} was written is not known", name));
  }
  if (getter != nullptr) require_same(now, written, name);
  if (written.text("written") == "no") print_message("note: nothing was sent, because it is so already");
  const Setting& shown = getter != nullptr ? now : written;
  if (invocation.has("--json")) {
    print_line(Json::object()
                   .set("ok", true)
                   .set("setting", name)
                   .set("old", getter != nullptr ? old.json.fields : Json())
                   .set("new", shown.json.fields)
                   .line());
  } else {
    show_change(name, old, shown);
  }
  return exit_good;
}

constexpr std::array<Parameter, 4> get_parameters{{
    parameter::encoder,
    {"name", "", "only this setting; see `absenc list <protocol>`"},
    parameter::json,
    parameter::option,
}};
constexpr std::array<Example, 2> get_examples{{
    {"absenc config get tformat:/dev/ttyUSB0", "all settings"},
    {"absenc config get sim:tformat overheat-threshold --json", "one of them, for programs"},
}};

constexpr std::array<Parameter, 7> set_parameters{{
    parameter::encoder,
    {"name", "", "of the setting", "", true},
    {"values", "", "numbers: decimal, or hexadecimal with 0x", "", true, true},
    parameter::yes,
    {"--force", "", "write also what is so already: each time may wear the encoder's memory"},
    parameter::json,
    parameter::option,
}};
constexpr std::array<Example, 2> set_examples{{
    {"absenc config set tformat:/dev/ttyUSB0 overheat-threshold 80", "over_heat above 80 degC; 0: never"},
    {"absenc config set sim:tformat overheat-threshold 0", "try it without hardware"},
}};

}  // namespace

const Subcommand config_get_subcommand{
    "config get", "read the settings of the encoder", "", get_parameters, get_examples, run_get};
const Subcommand config_set_subcommand{
    "config set",
    "change a setting of the encoder",
    "Asks first; without a terminal it needs --yes. The new value is read back and shown beside the old one; of what\n"
    "cannot be read, its effect is looked at.",
    set_parameters,
    set_examples,
    run_set};

}  // namespace absenc::tool
