// SPDX-License-Identifier: Apache-2.0
// Tests that commands end in bounded time on a line of characters that is never silent.
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absenc/protocol/all.hpp"
#include "absenc/sim/random.hpp"

namespace absenc {
namespace {

using namespace std::chrono_literals;

/// A function that returns the next byte on the line. `request`: the last request of the host.
using ByteSource = std::function<std::uint8_t(Bytes request)>;

struct Outcome {
  bool ended = false;
  Time duration{};
};

/// Runs the conversation on a line that carries one byte in each `period`.
Outcome run(Conversation<std::uint8_t>& conversation, Time period, const ByteSource& byte_source) {
  constexpr unsigned most_bytes = 2'000'000;
  Time now = 1s;
  const Time begin = now;
  Time next_byte = now + period;
  std::vector<std::uint8_t> request;
  for (unsigned bytes = 0; bytes < most_bytes;) {
    const ByteStep step = conversation.next(now);
    if (step.kind == ByteStep::Kind::done) return {true, now - begin};
    if (step.kind == ByteStep::Kind::emit && conversation.error() != Error::none) return {true, now - begin};
    if (step.kind == ByteStep::Kind::transfer || step.kind == ByteStep::Kind::pulse) {
      now = std::max(now, step.at);
      request.assign(step.out.begin(), step.out.end());
      next_byte = std::max(next_byte, now);
      conversation.feed({.kind = ByteEvent::Kind::sent, .at = now});
    } else if (step.kind == ByteStep::Kind::wait && step.at > now && step.at < next_byte) {
      now = step.at;
      conversation.feed({.kind = ByteEvent::Kind::timer, .at = now});
    } else if (step.kind == ByteStep::Kind::wait) {
      now = next_byte;
      next_byte += period;
      ++bytes;
      const std::uint8_t byte = byte_source(request);
      conversation.feed({.kind = ByteEvent::Kind::received, .at = now, .items = {&byte, 1}});
    }
  }
  return {false, now - begin};
}

constexpr std::string_view echo = "the request again";

struct Kind {
  std::string_view name;
  ByteSource byte_source;
};

std::vector<Kind> kinds() {
  const auto count = std::make_shared<std::size_t>(0);
  const auto random = std::make_shared<sim::Random>(1);
  return {{"55", [](Bytes) { return std::uint8_t{0x55}; }},
          {"CR", [](Bytes) { return std::uint8_t{'\r'}; }},
          {"random", [random](Bytes) { return static_cast<std::uint8_t>(random->below(256)); }},
          {echo, [count](Bytes request) {
             return request.empty() ? std::uint8_t{0} : request[(*count)++ % request.size()];
           }}};
}

Options defaults_of(const Unit& unit, std::span<const OptionText> settings = {}) {
  Options options;
  EXPECT_EQ(resolve_options(unit, {}, settings, options).kind, OptionError::Kind::none) << unit.id;
  return options;
}

/// Returns the default options of the unit, and variants in which one option that has choices has another value.
std::vector<Options> all_options(const Unit& unit) {
  std::vector<Options> all{defaults_of(unit)};
  for (const Option& option : unit.options) {
    for (const std::string_view choice : option.choices) {
      const std::array settings{OptionText{option.name, choice}};
      Options options;
      if (resolve_options(unit, {}, settings, options).kind == OptionError::Kind::none) all.push_back(options);
    }
  }
  return all;
}

std::vector<std::int64_t> least_arguments(const Command& command) {
  std::vector<std::int64_t> arguments;
  for (const Argument& argument : command.arguments) {
    arguments.push_back(argument.required ? std::max<std::int64_t>(argument.minimum, 1) : argument.default_value);
  }
  return arguments;
}

class NeverSilent : public ::testing::TestWithParam<const Unit*> {
 protected:
  // Runs each command on a line that is never silent; it must end within 30 s.
  void expect_ends(const Options& options, Time period, const Kind& kind) {
    for (const Command& command : unit.commands) {
      const Any<Conversation> made = unit.host(options, command, least_arguments(command), storage_);
      if (made.bytes == nullptr) continue;
      const Outcome outcome = run(*made.bytes, period, kind.byte_source);
      const auto what = [&] {
        return std::string(unit.id) + " " + std::string(command.name) + ", " + std::string(kind.name) + " every " +
               std::to_string(period / 1us) + " us: ";
      };
      EXPECT_TRUE(outcome.ended) << what() << "has not ended after " << outcome.duration / 1s << " s";
      EXPECT_LE(outcome.duration, 30s) << what();
      // A line that repeats the request may form a valid reply by chance, so the command may succeed.
      if (kind.name == echo) continue;
      EXPECT_NE(made.bytes->error(), Error::none) << what() << "taken for good";
    }
  }

  const Unit& unit = *GetParam();

 private:
  std::vector<std::byte> storage_ = std::vector<std::byte>(unit.host_storage);
};

TEST_P(NeverSilent, EveryCommandEnds) {
  for (const Time period : {10us, 1000us, 5000us, 19'000us}) {
    for (const Kind& kind : kinds()) expect_ends(defaults_of(unit), period, kind);
  }
}

TEST_P(NeverSilent, EveryCommandEndsWithEveryOption) {
  for (const Options& options : all_options(unit)) expect_ends(options, 5ms, kinds().front());
}

std::vector<const Unit*> units() {
  std::vector<const Unit*> found;
  for (const Unit* unit : all_units()) {
    if (unit->link == LinkKind::half_duplex || unit->link == LinkKind::full_duplex) found.push_back(unit);
  }
  return found;
}

std::string name_of(const ::testing::TestParamInfo<const Unit*>& info) {
  std::string name(info.param->id);
  for (char& character : name) {
    if (character == '-') character = '_';
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(Units, NeverSilent, ::testing::ValuesIn(units()), name_of);

}  // namespace
}  // namespace absenc
