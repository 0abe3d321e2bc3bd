// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/order.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "absenc/client/error.hpp"
#include "absenc/client/settings.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr std::size_t most_bytes = 4096;  // greatest number of memory addresses in one response

using Between = std::function<void()>;

OrderResult success(const Command& command, const Answer& answer, const std::string& note, ChangeState change) {
  const std::string done = change == ChangeState::unknown ? Change{change}.text() : "done";
  return {true, fmt::format("{}: {}{}{}", command.name, done, note.empty() ? "" : "; ", note), to_json(answer.row()),
          change};
}

OrderResult run_command(Encoder& encoder, const Order& order) {
  const Command& command = *order.command;
  if (command.verb != Verb::config_set) {
    const Answer answer = encoder.run(command.name, order.arguments);
    return success(command, answer, "", command.changes_encoder ? encoder.change().state : ChangeState::none);
  }
  const std::string_view setting = command.reads_back.empty() ? command.name : command.reads_back;
  const SettingChange change = encoder.settings().set(setting, order.arguments);
  return success(command, change.now, change.was_so ? "it had this value already" : change.note, change.state);
}

// Requests for settings or registers, each of which the encoder may leave unanswered. An order that consists of such
// requests succeeds if the encoder answers at least one of them.
class OptionalReads {
 public:
  OptionalReads(Encoder& encoder, const Between& between) : encoder_(&encoder), between_(&between) {}

  std::optional<Answer> ask(std::string_view command, std::span<const std::int64_t> arguments) {
    const bool first = !std::exchange(has_sent_, true);
    if (!first) (*between_)();
    was_sent_ = true;
    try {
      Answer answer = encoder_->run(command, arguments);
      answered_ = true;
      return answer;
    } catch (const EncoderFailure& failure) {
      last_ = fmt::format("{}: {}", text_of(failure.trouble.error).name, failure.trouble.message);
    } catch (const UsageError& error) {
      was_sent_ = false;
      last_ = error.what();
    }
    if (first_.empty()) first_ = last_;
    return std::nullopt;
  }

  /// Returns the error of the most recent request that failed.
  [[nodiscard]] const std::string& reason() const { return last_; }
  /// Returns whether the last request was sent; it is not sent if the options of the encoder forbid it.
  [[nodiscard]] bool was_sent() const { return was_sent_; }
  [[nodiscard]] OrderResult done(Json json) const {
    if (answered_) return {true, "read", std::move(json), ChangeState::none};
    return {false, first_, {}, ChangeState::none};
  }

 private:
  Encoder* encoder_;
  const Between* between_;
  bool has_sent_ = false;
  bool was_sent_ = false;
  bool answered_ = false;
  std::string first_;
  std::string last_;
};

std::string range_of(const Unit& unit, const Command& getter) {
  std::vector<std::string> texts;
  for (const Command& setter : unit.commands) {
    if (setter.verb != Verb::config_set || setter.reads_back != getter.name) continue;
    for (const Argument& argument : setter.arguments) {
      texts.push_back(
          fmt::format("{}: {} ({} to {})", argument.name, argument.meaning, argument.minimum, argument.maximum));
    }
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

// Returns a value as a JSON string in words that the page shows; JSON null for an invalid value.
Json value_for_people(const Column& column, const Value& value) {
  if (std::holds_alternative<Invalid>(value)) return {};
  if (std::holds_alternative<Unknown>(value)) return "unknown";
  const Flags* const flags = std::get_if<Flags>(&value);
  const std::string text = flags != nullptr ? fmt::format("{}", fmt::join(flag_names(*flags->field, flags->bits), ", "))
                                            : to_text(column, value);
  return text.empty() ? "none" : text;
}

Json row_for_people(const Column& column, const Value& value) {
  return Json::object()
      .set("field", column.name)
      .set("value", value_for_people(column, value))
      .set("meaning", column.meaning);
}

// Reads settings and identification of the encoder. `wanted`: the only command to run; null: every command that reads a
// setting or a part of the identification.
OrderResult read_settings(Encoder& encoder, const Command* wanted, const Between& between) {
  Json identity = Json::object();
  Json settings = Json::object();
  Json rows = Json::array();
  Json failed = Json::object();
  OptionalReads reads(encoder, between);
  for (const Command* getter : questions(encoder.unit())) {
    if (wanted != nullptr && wanted != getter) continue;
    const bool is_setting = getter->verb == Verb::config_get;
    const std::optional<Answer> answer = reads.ask(getter->name, {});
    if (!answer) {
      if (is_setting || reads.was_sent()) failed.set(getter->name, reads.reason());
      continue;
    }
    (is_setting ? settings : identity).set(getter->name, to_json(answer->row()));
    for (std::size_t i = 0; i < answer->columns.size(); ++i) {
      const Column& column = answer->columns[i];
      if (column.presentation.is_exchange) continue;
      Json row = row_for_people(column, answer->values[i]);
      rows.append(row.set("setting", getter->name).set("range", range_of(encoder.unit(), *getter)));
    }
  }
  Json json = Json::object().set("ok", true).set("identity", identity).set("settings", settings);
  return reads.done(json.set("rows", rows).set("failed", failed));
}

// Reads all readable registers. The value of a register is the last field of the reply to its read request.
OrderResult read_registers(Encoder& encoder, const Between& between) {
  const Command& command = *find_command(encoder.unit(), Verb::memory_read);
  Json registers = Json::array();
  Json failed = Json::object();
  OptionalReads questions(encoder, between);
  for (const RegisterInfo& one : encoder.unit().registers) {
    if (!one.readable) continue;
    const std::optional<Answer> answer =
        questions.ask(command.name, role_arguments(command, {{Role::address, one.address}}));
    if (!answer) {
      failed.set(one.name, questions.reason());
      continue;
    }
    registers.append(Json::object()
                         .set("name", one.name)
                         .set("address", one.address)
                         .set("fields", to_json(answer->row()))
                         .set("value", to_text(answer->columns.back(), answer->values.back())));
  }
  return questions.done(Json::object().set("ok", true).set("registers", registers).set("failed", failed));
}

OrderResult read_memory(Encoder& encoder, const MemoryImage& addresses, const Between& between) {
  const MemoryImage image = encoder.memory().read(addresses, [&](std::size_t done, std::size_t all) {
    if (done < all) between();
  });
  const Json parts = Json::list(runs(image), [&](const MemoryRun& run) {
    return Json::object()
        .set("page", run.first.page)
        .set("address", run.first.address)
        .set("data", words_in_json(encoder.unit(), run.words));
  });
  return {true, "read", Json::object().set("ok", true).set("bytes", image.size()).set("memory", parts),
          ChangeState::none};
}

}  // namespace

std::string_view Order::name() const {
  switch (kind) {
    case Kind::settings:
      return "reading the settings";
    case Kind::memory:
      return "reading the memory";
    case Kind::examination:
      return "doctor";
    case Kind::command:
      break;
  }
  return command->name;
}

Json shown_values(const Answer& answer) {
  Json rows = Json::array();
  for (std::size_t i = 0; i < answer.columns.size(); ++i) {
    if (!answer.columns[i].presentation.is_exchange) rows.append(row_for_people(answer.columns[i], answer.values[i]));
  }
  return rows;
}

Order settings_order(const Unit& unit, std::string_view setting) {
  const std::vector<const Command*> all = questions(unit);
  if (all.empty()) throw UsageError(fmt::format("{} has no settings and no identification", unit.id));
  Order order;
  if (!setting.empty()) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Command* one) { return one->name == setting; });
    std::vector<std::string_view> names;
    for (const Command* one : all) names.push_back(one->name);
    if (found == all.end()) {
      throw UsageError(fmt::format("{} has no setting \"{}\"{}", unit.id, setting, suggestion(setting, names)));
    }
    order.command = *found;
  }
  order.kind = Order::Kind::settings;
  return order;
}

Order memory_order(const Unit& unit, std::int64_t page) {
  Order order;
  order.kind = Order::Kind::memory;
  if (!unit.registers.empty() && find_command(unit, Verb::memory_read) != nullptr) return order;
  require_memory(unit, client::MemoryAccess::read);
  if (page < 0) order.addresses = dump_addresses(unit);
  for (const MemoryArea& area : unit.memory) {
    if (page < 0 || !area.has(static_cast<std::uint32_t>(page), area.first)) continue;
    for (std::uint32_t i = 0; i < area.count; ++i) {
      order.addresses[{static_cast<std::uint32_t>(page), area.first + i}] = 0;
    }
  }
  if (order.addresses.empty()) throw UsageError(fmt::format("the memory of {} has no page {}", unit.id, page));
  if (order.addresses.size() > most_bytes) {
    throw UsageError(fmt::format("{} bytes are too many, at most {} are read at once: select one page",
                                 order.addresses.size(), most_bytes));
  }
  return order;
}

Order examination_order() {
  Order order;
  order.kind = Order::Kind::examination;
  return order;
}

OrderResult carry_out(Encoder& encoder, const Order& order, const Between& between) {
  switch (order.kind) {
    case Order::Kind::settings:
      return read_settings(encoder, order.command, between);
    case Order::Kind::memory:
      if (order.addresses.empty()) return read_registers(encoder, between);
      return read_memory(encoder, order.addresses, between);
    default:
      return run_command(encoder, order);
  }
}

Json readable_json(const Unit& unit) {
  const Json settings = Json::list(questions(unit), [](const Command* command) { return command->name; });
  Json memory = Json::array();
  const bool has_memory = find_command(unit, Verb::memory_read) != nullptr;
  for (const MemoryArea& area : unit.memory) {
    if (!has_memory) break;
    memory.append(Json::object()
                      .set("page", area.page)
                      .set("pages", area.pages)
                      .set("first", area.first)
                      .set("count", area.count)
                      .set("meaning", area.meaning)
                      .set("in_dump", area.in_dump));
  }
  const auto readable = [](const RegisterInfo& one) { return one.readable; };
  const auto registers = std::count_if(unit.registers.begin(), unit.registers.end(), readable);
  return Json::object().set("settings", settings).set("memory", memory).set("registers", has_memory ? registers : 0);
}

}  // namespace absenc::serve
