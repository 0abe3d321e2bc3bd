// SPDX-License-Identifier: Apache-2.0
// For tests: encoders and a host on one line in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/raa38/unit.hpp"

namespace absenc::raa38::testing {

using author::testing::Talk;

struct Collector final : FieldSink {
  void put(const FieldValue& value) override {
    const bool is_text = value.info->kind == FieldInfo::Kind::text;
    if (value.info->kind == FieldInfo::Kind::real) return;
    text += std::string(value.info->name) + "=" +
            (is_text ? std::string(value.bytes.begin(), value.bytes.end()) : std::to_string(value.number)) + " ";
  }
  std::string text;
};

[[nodiscard]] inline bool says(std::string_view text, std::string_view words) {
  return text.find(words) != std::string_view::npos;
}

/// Result of a conversation, in the form in which tests compare it.
struct CommandResult {
  Error error = Error::none;
  std::string words{};   // detail and advice of the error
  std::string fields{};  // "name=value name=value ", without real numbers
  std::string left{};    // fields that the ended conversation gives to `report_left`, as text like `fields`
  std::optional<Reading> reading{};
  Time took{};

  [[nodiscard]] bool has(std::string_view field) const { return says(" " + fields, " " + std::string(field) + " "); }
};

template <class Item>
[[nodiscard]] CommandResult result_of(const Conversation<Item>& conversation) {
  Collector fields;
  Collector left;
  conversation.report(fields);
  conversation.report_left(left);
  CommandResult end{.error = conversation.error(), .fields = fields.text, .left = left.text};
  end.words = std::string(conversation.detail()) + "; " + std::string(conversation.advice());
  if (conversation.reading() != nullptr) end.reading = *conversation.reading();
  return end;
}

/// Checks that a conversation ended with `error` and that the detail or advice of the error contains `words`. After an
/// error the conversation must have reported no fields and no reading.
[[nodiscard]] inline ::testing::AssertionResult ended(const CommandResult& end, Error error,
                                                      std::string_view words = {}) {
  const bool good = end.error == error && says(end.words, words);
  const bool silent = error == Error::none || (end.fields.empty() && !end.reading);
  return (good && silent ? ::testing::AssertionSuccess() : ::testing::AssertionFailure())
         << text_of(end.error).name << ": " << end.words << ": " << end.fields;
}

/// A line with encoders and a host; `options_of(format)` must return the unit's options.
template <class Item, class Encoder, class Format, const Unit& unit>
struct Bench {
  Bench(const Format& own, LinkKind kind, const LineSettings& settings) : format(own), line(kind, settings) {}

  /// Adds an encoder to the line; all encoders share one shaft.
  Encoder& add(const Format& of_it) {
    encoders.emplace_back(of_it, shaft);
    encoders.back().power_on(line.now(), Device<Item>::PowerOn::skip);
    line.attach(sim::NodeRole::device, encoders.back());
    return encoders.back();
  }
  Encoder& encoder() { return encoders.front(); }

  /// Runs a host until it ends, or until `on_emit` returns false, but for at most 60 s.
  template <class Machine>
  Machine& run(Machine& machine, const std::function<bool()>& on_emit = {}) {
    const Time start = line.now();
    emitted = on_emit;
    if (host_end) {
      line.replace(*host_end, machine);  // the new host starts at the rate that the previous host has set
    } else {
      host_end = line.attach(sim::NodeRole::host, machine, [this] { return !emitted || emitted(); });
    }
    EXPECT_TRUE(line.run(*host_end, start + std::chrono::seconds(60)) || on_emit);
    took = line.now() - start;
    line.replace(*host_end, idle);
    return machine;
  }
  /// Runs a command and returns its result.
  CommandResult run_command(const Format& told, std::string_view command, std::vector<std::int64_t> arguments = {}) {
    Talk<Item> talk(unit, options_of(told), command, std::move(arguments));
    CommandResult end = result_of<Item>(run(*talk));
    end.took = took;
    return end;
  }
  CommandResult run_command(std::string_view command, std::vector<std::int64_t> arguments = {}) {
    return run_command(format, command, std::move(arguments));
  }
  [[nodiscard]] std::uint64_t position() { return run_command("position").reading.value_or(Reading{}).singleturn; }

  struct Idle final : Machine<Item> {
    void feed(const Event<Item>&) override {}
    Step<Item> next(Time) override { return {.at = never}; }
  };

  Format format;
  sim::testing::TestShaft<21> shaft;  // shaft with 21 bits, the finest resolution of an RAA38S6
  sim::Line<Item> line;
  std::list<Encoder> encoders;
  std::optional<std::size_t> host_end{};
  std::function<bool()> emitted{};
  Idle idle;
  Time took{};
};

/// Returns the time from a conversation's first request to its end on a line with endless noise.
inline Time time_with_noise(Conversation<std::uint8_t>& conversation) {
  using Kind = Step<std::uint8_t>::Kind;
  constexpr std::uint8_t noise = 0x55;
  Time now{};
  Time began = never;
  for (unsigned steps = 0; steps < 1'000'000; ++steps) {
    const Step<std::uint8_t> step = conversation.next(now);
    if (step.kind == Kind::done) return now - began;
    now += std::chrono::microseconds(100);
    if (step.kind == Kind::transfer) {
      began = std::min(began, now);
      conversation.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    } else if (step.kind == Kind::wait && began != never) {
      conversation.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = {&noise, 1}});
    }
  }
  return never;
}

}  // namespace absenc::raa38::testing
