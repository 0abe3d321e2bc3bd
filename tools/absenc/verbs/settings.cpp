// SPDX-License-Identifier: Apache-2.0
// The verbs `config get` and `config set`, for the settings of a protocol.
#include <fmt/format.h>

#include <array>
#include <utility>

#include "absenc/client/settings.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/consent.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

using Rows = std::vector<std::vector<std::string>>;

int run_get(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  std::vector<const Command*> settings = readable_settings(*uri.unit);
  if (invocation.has("name")) settings = {&require_readable_setting(*uri.unit, invocation.text("name"))};

  Encoder encoder = open_encoder(uri);
  Rows rows{{"SETTING", "FIELD", "VALUE", ""}};
  Json all = Json::object();
  for (const Command* command : settings) {
    const Answer answer = encoder.settings().get(command->name);
    all.set(command->name, to_json(answer.row()));
    std::string name(command->name);
    for (auto& row : to_table(answer.row())) {
      row.insert(row.begin(), std::exchange(name, ""));
      rows.push_back(std::move(row));
    }
  }
  print_line(invocation.has("--json") ? Json::object().set("ok", true).set("settings", all).line() : table(rows));
  return exit_good;
}

// Returns the value of a field as text; "-" if the encoder did not report the field.
std::string text_of_field(const Answer& answer, std::string_view field) {
  for (std::size_t i = 0; i < answer.columns.size(); ++i) {
    if (answer.columns[i].name == field) return to_text(answer.columns[i], answer.values[i]);
  }
  return "-";
}

void show_change(std::string_view name, const Answer& old, const Answer& now) {
  Rows rows{{"SETTING", "FIELD", "WAS", "IS"}};
  std::string first(name);
  const auto add = [&](std::string_view field) {
    rows.push_back(
        {std::exchange(first, ""), std::string(field), text_of_field(old, field), text_of_field(now, field)});
  };
  for (const Column& column : now.columns) add(column.name);
  for (const Column& column : old.columns) {
    if (text_of_field(now, column.name) == "-") add(column.name);
  }
  print_line(table(rows));
}

// Returns the arguments of the command that writes a setting. Throws UsageError.
std::vector<std::int64_t> setter_arguments(const Invocation& invocation, const Unit& unit, const Command& setter) {
  std::vector<std::int64_t> values = require_arguments(setter, invocation.texts("values"));
  if (!invocation.has("--force")) return values;
  const Argument* force = find_role(setter.arguments, Role::force);
  if (force == nullptr) throw UsageError(fmt::format("{} of {} knows no --force", setter.name, unit.id));
  values[static_cast<std::size_t>(force - setter.arguments.data())] = 1;
  return values;
}

int run_set(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  const Setting setting = require_setting(*uri.unit, invocation.text("name"));
  const bool readable = setting.getter != nullptr;
  const std::string_view name = setting.name();
  const std::vector<std::int64_t> values = setter_arguments(invocation, *uri.unit, *setting.setter);
  tell_disturbance(uri, *setting.setter);
  const bool asks = must_ask(invocation, uri, name, setting.setter->meaning);

  Encoder encoder = before_change([&] { return open_encoder(uri); });
  Settings settings = encoder.settings();
  const Answer old = readable ? before_change([&] { return settings.get(name); }) : Answer{};
  if (asks) {
    std::string is;
    for (const Column& column : old.columns) {
      is += fmt::format("{}{} is {}", is.empty() ? "" : ", ", column.name, text_of_field(old, column.name));
    }
    if (!readable) is = "what it is now cannot be read";
    if (!confirmed(uri, fmt::format("{} ({})", setting.setter->meaning, is))) {
      print_message("nothing was changed");
      return exit_failed;
    }
  }
  SettingChange change;
  try {
    change = settings.set(name, values);
  } catch (const os::Interrupted&) {
    throw OfChange<Failure>(Failure(fmt::format("interrupted while {} was set", name)), encoder.change());
  }
  if (const std::string& journal = encoder.change().note; !journal.empty()) {
    print_message(fmt::format("note: {}", journal));
  }
  if (!change.note.empty()) print_message(fmt::format("note: {}", change.note));
  if (change.was_so) print_message("note: nothing was sent, because it is so already");
  if (invocation.has("--json")) {
    print_line(Json::object()
                   .set("ok", true)
                   .set("setting", name)
                   .set("old", readable ? to_json(old.row()) : Json())
                   .set("new", to_json(change.now.row()))
                   .set("change", word_of(change.state))
                   .line());
  } else {
    show_change(name, old, change.now);
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
