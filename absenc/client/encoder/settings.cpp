// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>

#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"

namespace absenc::client {

namespace {

struct SettingSink final : FieldSink {
  void put(const FieldValue& value) override {
    if (value.info->role == Role::written) was_so = value.number == 0;
    sink.put(value);
  }
  AnswerSink sink;
  bool was_so = false;
};

Answer answer_to(Connection& encoder, const Command& command) {
  SettingSink told;
  run_into(encoder, command, {}, told);
  return std::move(told.sink.answer);
}

std::size_t place_of(const Answer& answer, std::string_view name) {
  const auto same = [&](const Column& column) { return column.name == name; };
  return static_cast<std::size_t>(std::find_if(answer.columns.begin(), answer.columns.end(), same) -
                                  answer.columns.begin());
}

// Runs the command that writes the setting. If the port is lost, adds to the exception which values the encoder may
// have.
void write(Connection& encoder, const Command& setter, Arguments arguments, SettingSink& told) {
  try {
    run_into(encoder, setter, arguments, told);
  } catch (const os::Failure& failure) {
    AnswerSink left;
    encoder.report_left(left);
    const Change& change = encoder.change();
    if (left.answer.columns.empty() || change.state != ChangeState::unknown) throw;
    std::string values;
    for (std::size_t i = 0; i < left.answer.columns.size(); ++i) {
      values += fmt::format("\n  {}: {}", left.answer.columns[i].name,
                            to_text(left.answer.columns[i], left.answer.values[i]));
    }
    const std::string text = fmt::format("{}\n{} was written, but what became of it could not be seen:{}",
                                         failure.what(), setter.name, values);
    throw OfChange<Failure>(Failure(text), text, change);
  }
}

// Throws Failure if the value of the setting that was read back differs from the written value. `advice`: how to find
// out which value the encoder has.
void require_same(const Answer& now, const Answer& written, std::string_view name, const std::string& advice) {
  for (std::size_t i = 0; i < written.columns.size(); ++i) {
    const std::size_t place = place_of(now, written.columns[i].name);
    if (place == now.columns.size() || now.values[place] == written.values[i]) continue;
    const Failure failure(fmt::format("{} was written, but {} reads as {} instead of {}", name, written.columns[i].name,
                                      to_text(now.columns[place], now.values[place]),
                                      to_text(written.columns[i], written.values[i])));
    throw OfChange<Failure>(failure, Change{ChangeState::unknown, advice});
  }
}

// Returns a sentence about the option with which the encoder is reached from now on; "" if it is unchanged.
std::string note_of(const Unit& unit, const Options& before, const Command& setter, std::int64_t value) {
  if (options_behind(unit, before, setter, value).values == before.values) return {};
  return fmt::format("from now on it is reached with {}={}", setter.changes_option, value);
}

}  // namespace

std::vector<const Command*> questions(const Unit& unit) {
  std::vector<const Command*> all;
  for (const Verb verb : {Verb::info, Verb::temperature, Verb::config_get}) {
    for (const Command& command : unit.commands) {
      if (command.verb == verb && std::ranges::none_of(command.arguments, &Argument::required)) all.push_back(&command);
    }
  }
  return all;
}

std::vector<const Command*> questions(const Unit& unit, const Options& options) {
  std::vector<const Command*> all = questions(unit);
  std::erase_if(all, [&](const Command* command) {
    const std::vector<std::int64_t> arguments = complete_arguments(*command, {});
    const auto storage = std::make_unique<std::byte[]>(unit.host_storage);
    const Any<Conversation> made = unit.host(options, *command, arguments, {storage.get(), unit.host_storage});
    return made.bytes == nullptr && made.frames == nullptr;
  });
  return all;
}

std::vector<const Command*> readable_settings(const Unit& unit) {
  std::vector<const Command*> settings;
  for (const Command& command : unit.commands) {
    if (command.verb == Verb::config_get) settings.push_back(&command);
  }
  if (settings.empty()) throw UsageError(fmt::format("{} has no settings", unit.id));
  return settings;
}

const Command& require_readable_setting(const Unit& unit, std::string_view name) {
  std::vector<std::string_view> names;
  for (const Command* setting : readable_settings(unit)) {
    if (setting->name == name) return *setting;
    names.push_back(setting->name);
  }
  throw UsageError(fmt::format("{} has no setting \"{}\"{}", unit.id, name, suggestion(name, names)));
}

Setting require_setting(const Unit& unit, std::string_view name) {
  const auto is_setter = [](const Command& command) { return command.verb == Verb::config_set; };
  for (const Command& command : unit.commands) {
    if (is_setter(command) && command.reads_back.empty() && command.name == name) return {&command, nullptr};
  }
  const Command& getter = require_readable_setting(unit, name);
  for (const Command& command : unit.commands) {
    if (is_setter(command) && command.reads_back == getter.name) return {&command, &getter};
  }
  throw UsageError(fmt::format("{} of {} can only be read", getter.name, unit.id));
}

Answer Settings::get(std::string_view name) {
  return answer_to(connection_of(*encoder_), require_readable_setting(encoder_->unit(), name));
}

SettingChange Settings::set(std::string_view name, std::span<const std::int64_t> arguments) {
  Connection& connection = connection_of(*encoder_);
  const Setting setting = require_setting(connection.unit(), name);
  const std::vector<std::int64_t> values = complete_arguments(*setting.setter, arguments);
  const EncoderAddress before = connection.uri();
  SettingSink told;
  write(connection, *setting.setter, values, told);
  const Answer& written = told.sink.answer;
  SettingChange change{written, told.was_so, connection.change().state,
                       note_of(connection.unit(), before.options, *setting.setter, values.front())};
  if (setting.getter == nullptr) return change;
  try {
    change.now = answer_to(connection, *setting.getter);
    require_same(change.now, written, setting.name(), advice_to_look(before, *setting.setter, values));
  } catch (const std::exception&) {
    rethrow_with(connection.change());
  }
  return change;
}

}  // namespace absenc::client
