// SPDX-License-Identifier: Apache-2.0
// For tests: the virtual E201-9S and the unit's commands on one line in virtual time.
#pragma once

#include <gtest/gtest.h>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/e201/frame.hpp"
#include "absenc/protocol/e201/unit.hpp"

namespace absenc::e201::testing {

using author::testing::RunResult;
using Fields = std::map<std::string, std::int64_t>;

constexpr std::int64_t turn = std::int64_t{1} << 32;
constexpr std::int64_t count = std::int64_t{1} << 13;  // size of one count of 19 bits, in 2^-32 revolution

inline bool says(const std::string& text, const std::string& words) { return text.find(words) != std::string::npos; }

/// A text that a test sends instead of the interface's reply.
struct TextReply {
  std::string text;
  Time after = 1ms;
};
using Tamper = std::function<std::optional<std::vector<TextReply>>(char letter)>;

inline Tamper answering(char letter, const std::vector<TextReply>& answer) {
  return [=](char asked) { return asked == letter ? std::optional(answer) : std::nullopt; };
}

/// The virtual interface on a test line; the function `tamper` may answer a command in its place.
class TamperedInterface final : public Machine<std::uint8_t> {
 public:
  explicit TamperedInterface(Device<std::uint8_t>& device) : device_(device) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::sent) {
      busy_ = false;
      if (std::exchange(sending_text_, false)) return;
    }
    if (event.kind != Event<std::uint8_t>::Kind::received) return device_.feed(event);
    for (const std::uint8_t byte : event.items) {
      const auto asked = static_cast<char>(byte);
      if (rest_ > 0) {
        if (--rest_; is_tampered_) continue;
      } else {
        log.emplace_back(asked, event.at);
        const auto answer = tamper ? tamper(asked) : std::nullopt;
        if (answer) pending_texts_ = *answer;
        rest_ = asked == 'M' ? 2 : 0;
        is_tampered_ = answer.has_value();
        if (is_tampered_) continue;
      }
      device_.feed({.kind = event.kind, .at = event.at, .items = {&byte, 1}});
    }
  }
  Step<std::uint8_t> next(Time now) override {
    if (busy_) return {.at = never};
    if (pending_texts_.empty()) {
      const Step<std::uint8_t> step = device_.next(now);
      busy_ = step.kind == Step<std::uint8_t>::Kind::transfer;
      return step;
    }
    out_ = pending_texts_.front();
    pending_texts_.erase(pending_texts_.begin());
    sending_text_ = busy_ = true;
    return {.kind = Step<std::uint8_t>::Kind::transfer,
            .out = {reinterpret_cast<const std::uint8_t*>(out_.text.data()), out_.text.size()},
            .at = now + out_.after};
  }
  /// Returns the letters of all commands in `log`.
  [[nodiscard]] std::string asked() const {
    std::string letters;
    for (const auto& [letter, at] : log) letters += letter;
    return letters;
  }

  Tamper tamper;
  std::vector<std::pair<char, Time>> log;

 private:
  Device<std::uint8_t>& device_;
  std::vector<TextReply> pending_texts_;
  TextReply out_;
  unsigned rest_ = 0;  // number of bytes still to be received of a command `M`
  bool is_tampered_ = false;
  bool busy_ = false;          // whether bytes are being sent to the host
  bool sending_text_ = false;  // whether the bytes being sent are a text of `tamper`
};

/// Result of a command, with the name of its error.
struct CommandResult : RunResult {
  CommandResult(const RunResult& told)
      : RunResult(told), error(told.finished ? text_of(told.error).name : "hangs"), fields(told.numbers) {}
  std::string error;
  Fields fields;
};

struct Bench : author::testing::UnitBench<19> {
  explicit Bench(std::string_view settings = "singleturn_bits=19 multiturn_bits=16") : UnitBench(e201::unit, settings) {
    line.replace(0, answering);
  }
  CommandResult run(std::string_view name, const std::vector<std::int64_t>& arguments = {},
                    const OnEmit& on_emit = {}) {
    return UnitBench::run(name, arguments, on_emit);
  }
  /// Runs a command while `tamper` may replace replies; `answering.log` has the received commands.
  CommandResult run_tampered(const Tamper& tamper, std::string_view name,
                             const std::vector<std::int64_t>& arguments = {}) {
    answering.tamper = tamper;
    answering.log.clear();
    const CommandResult ended = run(name, arguments);
    answering.tamper = nullptr;
    pass(1s);
    return ended;
  }
  std::string raw(const std::string& request) {
    const auto reply = UnitBench::raw({request.begin(), request.end()}).reply;
    return {reply.begin(), reply.end()};
  }

  TamperedInterface answering{device};
};

}  // namespace absenc::e201::testing
