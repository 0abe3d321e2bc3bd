// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/encoder/change_record.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "absenc/client/encoder/connection.hpp"
#include "absenc/client/port/journal.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/trouble.hpp"

namespace absenc::client {

namespace {

std::optional<std::int64_t> integer_in(const Value& value) {
  if (const auto* one = std::get_if<std::int64_t>(&value)) return *one;
  if (const auto* one = std::get_if<std::uint64_t>(&value); one != nullptr && *one <= INT64_MAX) {
    return static_cast<std::int64_t>(*one);
  }
  return std::nullopt;
}

// Runs a reading command and returns the fields of its reply; nothing if the command fails.
std::optional<Answer> ask(Connection& connection, const Command& reader, Arguments arguments) {
  AnswerSink sink;
  try {
    run_into(connection, reader, arguments, sink);
  } catch (const EncoderFailure&) {
    return std::nullopt;
  }
  return std::move(sink.answer);
}

std::string with_setting(const std::string& address, std::string_view name, std::int64_t value) {
  const std::size_t question = std::min(address.find('?'), address.size());
  std::string result = address.substr(0, question);
  char joint = '?';
  for (std::size_t begin = question + 1; begin < address.size();) {
    const std::size_t end = std::min(address.find('&', begin), address.size());
    const std::string one = address.substr(begin, end - begin);
    begin = end + 1;
    if (one.starts_with(fmt::format("{}=", name))) continue;
    result += fmt::format("{}{}", std::exchange(joint, '&'), one);
  }
  return fmt::format("{}{}{}={}", result, joint, name, value);
}

}  // namespace

ChangeRecord::ChangeRecord(Connection& connection, const Command& command, Arguments arguments,
                           std::optional<std::int64_t> known)
    : connection_(connection), command_(command), arguments_(arguments.begin(), arguments.end()), old_value_(known) {
  if (known || journal_path().empty()) return;
  if (command.verb == Verb::config_set && !command.reads_back.empty()) look_at_setting();
  if (command.verb == Verb::memory_write) look_at_memory();
}

std::int64_t ChangeRecord::argument(Role role) const { return role_value(command_, arguments_, role); }

void ChangeRecord::look_at_setting() {
  const Command* const getter = find_command(connection_.unit(), command_.reads_back);
  if (getter != nullptr) old_ = ask(connection_, *getter, complete_arguments(*getter, {}));
}

void ChangeRecord::look_at_memory() {
  const Command* const reader = find_command(connection_.unit(), Verb::memory_read);
  if (reader == nullptr) return;
  const std::vector<std::int64_t> where = role_arguments(
      *reader, {{Role::page, argument(Role::page)}, {Role::address, argument(Role::address)}, {Role::count, 1}});
  const std::optional<Answer> answer = ask(connection_, *reader, where);
  if (!answer) return;
  for (std::size_t i = 0; i < answer->columns.size(); ++i) {
    if (answer->columns[i].name == "value") old_value_ = integer_in(answer->values[i]);
  }
}

// Finds the old value of the setting. Stores no value if it is uncertain which field of the reply the command sets.
void ChangeRecord::find_old_value(bool good) {
  if (!old_ || arguments_.empty()) return;
  if (std::ranges::count_if(command_.arguments, &Argument::required) != 1) return;
  AnswerSink written;
  if (good) connection_.report(written);
  std::vector<std::int64_t> candidates;
  for (std::size_t i = 0; i < old_->columns.size(); ++i) {
    const std::optional<std::int64_t> value = integer_in(old_->values[i]);
    if (!value || old_->columns[i].presentation.is_exchange) continue;
    bool fits = !good;
    for (std::size_t j = 0; j < written.answer.columns.size(); ++j) {
      fits = fits || (written.answer.columns[j].name == old_->columns[i].name &&
                      integer_in(written.answer.values[j]) == arguments_.front());
    }
    if (fits) candidates.push_back(*value);
  }
  if (candidates.size() == 1) old_value_ = candidates.front();
}

std::string ChangeRecord::what() const {
  if (command_.verb == Verb::config_set) {
    return fmt::format("config set {}", command_.reads_back.empty() ? command_.name : command_.reads_back);
  }
  if (command_.verb == Verb::memory_write) {
    const std::int64_t page = argument(Role::page);
    return fmt::format("memory write 0x{:02X}{}", argument(Role::address),
                       page != 0 ? fmt::format(" --page {}", page) : "");
  }
  return std::string(command_.name);
}

std::string ChangeRecord::after() const {
  if (command_.verb == Verb::memory_write) return fmt::format("0x{:02X}", argument(Role::value));
  std::vector<std::int64_t> values;
  for (std::size_t i = 0; i < arguments_.size(); ++i) {
    if (command_.arguments[i].required) values.push_back(arguments_[i]);
  }
  return fmt::format("{}", fmt::join(values, " "));
}

std::string ChangeRecord::put_back(const EncoderAddress& way, bool moved) const {
  if (!old_value_) return {};
  const std::string address =
      moved ? with_setting(way.written, command_.changes_option, arguments_.front()) : way.written;
  if (command_.verb == Verb::config_set) {
    const std::string_view name = command_.reads_back;
    if (*old_value_ == arguments_.front()) return {};
    return fmt::format("absenc config set \"{}\" {} {}", address, name, *old_value_);
  }
  if (*old_value_ == argument(Role::value)) return {};
  const std::int64_t page = argument(Role::page);
  return fmt::format("absenc memory write \"{}\" 0x{:02X} 0x{:02X}{}{}", address, argument(Role::address), *old_value_,
                     page != 0 ? fmt::format(" --page {}", page) : "", argument(Role::force) != 0 ? " --force" : "");
}

std::string ChangeRecord::keep(const EncoderAddress& way, const Change& change) {
  const std::string path = journal_path();
  if (path.empty() || change.state == ChangeState::not_sent || change.state == ChangeState::none) return {};
  const bool good = change.state == ChangeState::confirmed;
  if (command_.verb == Verb::config_set) find_old_value(good);
  std::string before;
  if (old_value_) {
    before =
        command_.verb == Verb::memory_write ? fmt::format("0x{:02X}", *old_value_) : fmt::format("{}", *old_value_);
  } else if (old_) {
    for (std::size_t i = 0; i < old_->columns.size(); ++i) {
      before += fmt::format("{}{}={}", i == 0 ? "" : " ", old_->columns[i].name, to_text(old_->values[i]));
    }
  }
  const bool refused = change.state == ChangeState::refused;
  return append_to_journal(path, {.encoder = way.written,
                                  .what = what(),
                                  .before = before,
                                  .after = after(),
                                  .result = std::string(word_of(change.state)),
                                  .put_back = refused ? "" : put_back(way, good && !command_.changes_option.empty())});
}

}  // namespace absenc::client
