// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform/changes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <span>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/settings.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"

namespace absenc::client {

namespace {

// Longer than any encoder is busy with a byte and its reply is under way.
constexpr Time settling = std::chrono::milliseconds(50);
constexpr unsigned tries = 3;        // to put back one thing
constexpr std::uint32_t beside = 4;  // bytes before the one that is written
constexpr unsigned nearness = 512;   // parts of a turn within which a position is the same

/// The encoder refused, or answered badly: the clause is broken.
struct Refused {
  std::string evidence;
};

std::int64_t number_of(const Answer& answer, std::string_view field) {
  const Value& value = answer[field];
  if (const auto* number = std::get_if<std::int64_t>(&value)) return *number;
  if (const auto* counts = std::get_if<std::uint64_t>(&value)) return static_cast<std::int64_t>(*counts);
  throw Refused{fmt::format("{} was not told", field)};
}

}  // namespace

bool is_near(const Reading& reading, std::uint64_t wanted) {
  const std::uint64_t turn = std::uint64_t{1} << reading.singleturn_bits;
  const std::uint64_t away = (reading.singleturn - wanted) & (turn - 1);
  return std::min(away, turn - away) <= turn / nearness;
}

void Changes::test(const Clause& clause, ClauseResult& result) {
  try {
    test_one(clause, result);
  } catch (...) {
    put_back();
    throw;
  }
  put_back();
  if (interrupted_) throw os::Interrupted{};
}

void Changes::test_one(const Clause& clause, ClauseResult& result) {
  try {
    switch (clause.demand) {
      case Demand::byte_written:
      case Demand::byte_alone:
        return test_byte(clause, result);
      case Demand::set:
        return test_setting(clause, result);
      case Demand::zeroed:
        return test_zero(clause, result);
      case Demand::reset:
        return test_reset(clause, result);
      default:
        return;
    }
  } catch (const Refused& refused) {
    conclude(result, false, refused.evidence);
  } catch (const os::Failure& failure) {
    if (failure.kind() != os::Failure::Kind::unsupported) throw;
    result.evidence = failure.what();  // of the port, before the encoder was changed
  }
}

void Changes::test_byte(const Clause& clause, ClauseResult& result) {
  const bool alone = clause.demand == Demand::byte_alone;
  if (!clause.setting.empty()) save_setting(clause);  // which reading the memory changes
  const std::uint32_t first = alone && clause.address >= beside ? clause.address - beside : clause.address;
  for (std::uint32_t at = first; at <= clause.address; ++at) save_byte(clause, at);
  const Saved& byte = saved_.back();
  const std::int64_t written = byte.value ^ 0xFF;
  write(byte, written);
  if (!alone) {
    const std::int64_t now = value_of(byte);
    return conclude(result, now == written, fmt::format("0x{:02X} was written, 0x{:02X} is read", written, now));
  }
  const auto others = std::span(saved_).first(saved_.size() - 1).last(clause.address - first);
  const auto same =
      std::count_if(others.begin(), others.end(), [&](const Saved& other) { return value_of(other) == other.value; });
  conclude(result, same == std::ssize(others), fmt::format("{} of {} are as before", same, others.size()));
}

void Changes::test_setting(const Clause& clause, ClauseResult& result) {
  const std::int64_t wanted = save_setting(clause) == clause.value ? clause.other : clause.value;
  write(saved_.back(), wanted);
  const std::int64_t now = value_of(saved_.back());
  conclude(result, now == wanted, fmt::format("set to {}, reads as {}", wanted, now));
}

void Changes::test_zero(const Clause& clause, ClauseResult& result) {
  save_setting(clause);
  const Command& zero = *find_command(unit_, Verb::zero);
  static_cast<void>(run(zero, complete_arguments(zero, std::array{clause.value})));
  const Reading reading = read();
  conclude(result, is_near(reading, 0), fmt::format("then the position is {}", reading.singleturn));
}

// A reset cannot be undone: it is sent only where it changes nothing.
void Changes::test_reset(const Clause& clause, ClauseResult& result) {
  const Reading before = read();
  const bool turns = clause.verb == Verb::reset_multiturn;
  if (before.alarms != 0 || (turns && before.multiturn != 0)) {
    result.evidence = before.alarms != 0
                          ? "there are alarms, which nothing could raise again"
                          : fmt::format("there are {} turns, which nothing could bring back", before.multiturn);
    return;
  }
  const Command& command = *find_command(unit_, clause.verb);
  static_cast<void>(run(command, complete_arguments(command, {})));
  const Reading after = read();
  conclude(result, after.alarms == 0 && after.multiturn == before.multiturn && is_near(after, before.singleturn),
           fmt::format("position {}, turns {} before, {}, {} after", before.singleturn, before.multiturn,
                       after.singleturn, after.multiturn));
}

std::int64_t Changes::save_byte(const Clause& clause, std::uint32_t address) {
  Saved one{.getter = find_command(unit_, Verb::memory_read), .setter = find_command(unit_, Verb::memory_write)};
  one.where = role_arguments(*one.getter, {{Role::page, clause.page}, {Role::address, address}, {Role::count, 1}});
  one.arguments = role_arguments(*one.setter, {{Role::page, clause.page}, {Role::address, address}});
  one.value = value_of(one);
  const bool paged = find_role(one.setter->arguments, Role::page) != nullptr;
  one.by_hand = fmt::format("absenc memory write {} 0x{:02X} 0x{:02X}{}", name_, address, one.value,
                            paged ? fmt::format(" --page {}", clause.page) : "");
  saved_.push_back(std::move(one));
  return saved_.back().value;
}

std::int64_t Changes::save_setting(const Clause& clause) {
  const Setting setting = require_setting(unit_, clause.setting);
  Saved one{.getter = setting.getter, .field = clause.field, .setter = setting.setter};
  one.where = complete_arguments(*setting.getter, {});
  one.arguments = complete_arguments(*setting.setter, std::array{clause.value});
  one.value = value_of(one);
  one.by_hand = fmt::format("absenc config set {} {} {}", name_, clause.setting, one.value);
  if (!setting.setter->changes_option.empty()) {
    const std::int64_t wanted = one.value == clause.value ? clause.other : clause.value;
    one.by_hand += fmt::format(" --option {}={}", setting.setter->changes_option, wanted);
  }
  saved_.push_back(std::move(one));
  return saved_.back().value;
}

void Changes::put_back() {
  while (!saved_.empty()) {
    const Saved one = std::move(saved_.back());
    saved_.pop_back();
    if (!put_back(one)) left_.push_back(one.by_hand);
  }
}

// Whoever asks once more to end meanwhile has to wait: the encoder would be left changed.
bool Changes::put_back(const Saved& one) {
  for (unsigned i = 0; i < tries; ++i) {
    try {
      line_.rest(settling);
      if (value_of(one) == one.value) return true;
      write(one, one.value);
      if (value_of(one) == one.value) return true;
    } catch (const os::Interrupted&) {
      interrupted_ = true;
    } catch (const os::Ended&) {
      interrupted_ = true;
    } catch (const Refused&) {  // once more
    } catch (const std::exception&) {
    }
  }
  return false;
}

std::int64_t Changes::value_of(const Saved& one) const {
  const Ran ran = run(*one.getter, one.where);
  if (!one.field.empty()) {
    const std::int64_t value = number_of(ran.answer, one.field);
    line_.follow(*one.setter, value);
    return value;
  }
  if (ran.data.empty()) throw Refused{"no byte was told"};
  return ran.data.front();
}

void Changes::write(const Saved& one, std::int64_t value) const {
  std::vector<std::int64_t> arguments = one.arguments;
  const Argument* place = find_role(one.setter->arguments, Role::value);
  arguments[place != nullptr ? static_cast<std::size_t>(place - one.setter->arguments.data()) : 0] = value;
  static_cast<void>(run(*one.setter, arguments));
  if (!one.field.empty()) line_.follow(*one.setter, value);
}

Ran Changes::run(const Command& command, Arguments arguments) const {
  Ran ran = line_.run(command, arguments);
  if (ran.error == Error::none) return ran;
  const std::string_view name = error_texts[static_cast<std::size_t>(ran.error)].name;
  throw Refused{fmt::format("{}: {} {}", command.name, name, ran.detail)};
}

Reading Changes::read() const {
  const Ran ran = run(*find_command(unit_, Verb::read), {});
  if (!ran.reading) throw Refused{"no position was told"};
  return *ran.reading;
}

}  // namespace absenc::client
