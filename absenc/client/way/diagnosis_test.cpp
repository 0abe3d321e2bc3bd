// SPDX-License-Identifier: Apache-2.0
// What people are told of an exchange that failed: each thing once.
#include "absenc/client/way/diagnosis.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "absenc/protocol/all.hpp"
#include "tests/kit/world.hpp"

namespace absenc::client {
namespace {

using kit::Configuration;
using kit::Ended;
using kit::World;

struct Message {
  std::string text;
  Diagnosis diagnosis;
};

Message message_of(const Unit& unit, const Options& options, const Ended& ended) {
  const Diagnosis diagnosis = diagnose(unit, options, {.bytes = ended.sent}, {.bytes = ended.received});
  return {describe(ended.error, ended.detail, diagnosis), diagnosis};
}

/// The clauses that stand in a message more than once. What checks a frame has two names.
std::set<std::string> repeated_clauses(std::string message) {
  for (std::size_t at = 0; (at = message.find("CRC", at)) != std::string::npos;) message.replace(at, 3, "checksum");
  std::set<std::string> once;
  std::set<std::string> twice;
  for (std::size_t begin = 0; begin < message.size();) {
    const std::size_t end = std::min(message.find("; ", begin), message.find(": ", begin));
    const std::string clause = message.substr(begin, end - begin);
    if (!once.insert(clause).second) twice.insert(clause);
    begin = end == std::string::npos ? end : end + 2;
  }
  return twice;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

std::vector<const Unit*> units_of_bytes() {
  std::vector<const Unit*> units(all_units().begin(), all_units().end());
  std::erase_if(units, [](const Unit* unit) {
    return unit->link == LinkKind::can || unit->link == LinkKind::spi || unit->link == LinkKind::clocked;
  });
  return units;
}

// An encoder that is set up otherwise than its host: each choice of each option.
TEST(Diagnosis, ASettingThatWouldHelpIsNamedOnce) {
  std::set<std::string> named;
  for (const Unit* unit : units_of_bytes()) {
    const Options here = kit::configurations(*unit).front().options;
    for (std::size_t i = 0; i < unit->options.size(); ++i) {
      for (std::size_t value = 0; value < unit->options[i].choices.size(); ++value) {
        Options there = here;
        there.values[i] = static_cast<std::int64_t>(value);
        World<std::uint8_t> world(*unit, there, 1);
        if (there.values == here.values || !world.made()) continue;
        world.move(0x2'4567'89AB);
        world.set_options(here);
        const Command& read = *find_command(*unit, Verb::read);
        const Ended ended = world.run(read, kit::least_arguments(read), std::chrono::milliseconds(100));
        if (!ended.made || !ended.ended || ended.error == Error::none) continue;
        const auto& [text, diagnosis] = message_of(*unit, here, ended);
        EXPECT_EQ(repeated_clauses(text), std::set<std::string>{}) << unit->id;
        if (diagnosis.setting.empty()) continue;
        named.insert(std::string(unit->id));
        EXPECT_EQ(count_of(text, diagnosis.setting), 1u) << unit->id << ": " << text;
      }
    }
  }
  EXPECT_GE(named.size(), 2u);
}

// A line that damages what comes, in each way.
TEST(Diagnosis, AMessageSaysNothingTwice) {
  unsigned messages = 0;
  for (const Unit* unit : units_of_bytes()) {
    const Options options = kit::configurations(*unit).front().options;
    for (std::size_t kind = 0; kind < sim::fault_names.size(); ++kind) {
      for (const Command& command : unit->commands) {
        World<std::uint8_t> world(*unit, options, 1);
        sim::FaultRates rates;
        rates.rates[kind] = 1;
        world.set_rates(rates);
        const Ended ended = world.run(command, kit::least_arguments(command), std::chrono::milliseconds(20));
        if (!ended.made || !ended.ended || ended.error == Error::none) continue;
        const std::string text = message_of(*unit, options, ended).text;
        EXPECT_EQ(repeated_clauses(text), std::set<std::string>{}) << unit->id << " " << command.name;
        ++messages;
      }
    }
  }
  EXPECT_GT(messages, 100u);
}

}  // namespace
}  // namespace absenc::client
