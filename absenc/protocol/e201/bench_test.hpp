// SPDX-License-Identifier: Apache-2.0
// For tests: the virtual E201-9S and the unit's commands on one line in virtual time.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "absenc/protocol/author/text.hpp"
#include "absenc/protocol/e201/device.hpp"
#include "absenc/protocol/e201/unit.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::e201::testing {

using Fields = std::map<std::string, std::int64_t>;

/// Name and value of every field; real numbers rounded.
struct Collector final : FieldSink {
  void put(const FieldValue& value) override {
    const bool is_real = value.info->kind == FieldInfo::Kind::real;
    fields[std::string(value.info->name)] = is_real ? static_cast<std::int64_t>(value.real) : value.number;
  }
  void put_reading(const Reading&) override { ++readings; }
  Fields fields;
  unsigned readings = 0;
};

/// "name=value name=value".
inline Options options_of(std::string_view text) {
  std::vector<OptionText> settings;
  author::for_each_value(text, [&settings](std::string_view name, std::string_view value) {
    settings.push_back({name, value});
    return true;
  });
  Options options;
  if (resolve_options(unit, {}, settings, options).kind != OptionError::Kind::none)
    throw std::logic_error("no such option");
  return options;
}

inline bool says(const std::string& text, const std::string& words) { return text.find(words) != std::string::npos; }

/// What comes in place of the interface's answer: each so long after what was before it.
struct Said {
  std::string text;
  Time after = 1ms;
};
using Tamper = std::function<std::optional<std::vector<Said>>(char letter)>;

inline Tamper answering(char letter, const std::vector<Said>& answer) {
  return [=](char asked) { return asked == letter ? std::optional(answer) : std::nullopt; };
}

/// Passes on what the interface does, but for commands that `tamper` answers itself.
class Tampered final : public Machine<std::uint8_t> {
 public:
  explicit Tampered(Device<std::uint8_t>& device) : device_(device) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::sent) {
      busy_ = false;
      if (std::exchange(saying_, false)) return;
    }
    if (event.kind != Event<std::uint8_t>::Kind::received) return device_.feed(event);
    for (const std::uint8_t byte : event.items) {
      const auto asked = static_cast<char>(byte);
      if (rest_ > 0) {
        if (--rest_; swallowed_) continue;
      } else {
        log.emplace_back(asked, event.at);
        const auto answer = tamper ? tamper(asked) : std::nullopt;
        if (answer) due_ = *answer;
        rest_ = asked == 'M' ? 2 : 0;
        swallowed_ = answer.has_value();
        if (swallowed_) continue;
      }
      device_.feed({.kind = event.kind, .at = event.at, .items = {&byte, 1}});
    }
  }
  Step<std::uint8_t> next(Time now) override {
    if (busy_) return {.at = never};
    if (due_.empty()) {
      const Step<std::uint8_t> step = device_.next(now);
      busy_ = step.kind == Step<std::uint8_t>::Kind::transfer;
      return step;
    }
    out_ = due_.front();
    due_.erase(due_.begin());
    saying_ = busy_ = true;
    return {.kind = Step<std::uint8_t>::Kind::transfer,
            .out = {reinterpret_cast<const std::uint8_t*>(out_.text.data()), out_.text.size()},
            .at = now + out_.after};
  }
  /// The letters of all commands so far.
  [[nodiscard]] std::string asked() const {
    std::string letters;
    for (const auto& [letter, at] : log) letters += letter;
    return letters;
  }

  Tamper tamper;
  std::vector<std::pair<char, Time>> log;

 private:
  Device<std::uint8_t>& device_;
  std::vector<Said> due_;
  Said out_;
  unsigned rest_ = 0;  // bytes of this command that are still to come
  bool swallowed_ = false;
  bool busy_ = false;    // something is being sent
  bool saying_ = false;  // and it is not the device's
};

/// Sends a text and keeps what comes back until the line is silent.
class RawHost final : public Machine<std::uint8_t> {
 public:
  explicit RawHost(const std::string& request) : request_(request.begin(), request.end()) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::received) reply.append(event.items.begin(), event.items.end());
    if (event.kind == Event<std::uint8_t>::Kind::silence) done_ = true;
  }
  Step<std::uint8_t> next(Time) override {
    using Kind = Step<std::uint8_t>::Kind;
    if (done_) return {.kind = Kind::done};
    if (std::exchange(sending_, true)) return {.at = never, .answer = 50ms, .gap = 5ms};
    return {.kind = Kind::transfer, .out = request_};
  }

  std::string reply;

 private:
  std::vector<std::uint8_t> request_;
  bool sending_ = false;
  bool done_ = false;
};

struct TestShaft final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override { return state; }
  ShaftState state{};
};

/// How a command ended.
struct Ended {
  std::string error;
  std::string detail;
  std::string advice;
  Fields fields;
  std::optional<Reading> reading;
  Time took{};
};

struct Bench {
  explicit Bench(std::string_view settings = "singleturn_bits=19 multiturn_bits=16") : options(options_of(settings)) {
    device.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line.attach(sim::Role::device, tampered);
  }

  Conversation<std::uint8_t>& make(std::string_view name, const std::vector<std::int64_t>& arguments = {}) {
    return *unit.host(options, *find_command(unit, name), arguments, host_storage).bytes;
  }
  Ended run(std::string_view name, const std::vector<std::int64_t>& arguments = {},
            const std::function<void(Conversation<std::uint8_t>&)>& on_emit = {}) {
    Conversation<std::uint8_t>& conversation = make(name, arguments);
    const Time begin = line.now();
    const std::size_t host = line.attach(sim::Role::host, conversation, [&] {
      if (on_emit) on_emit(conversation);
      return true;
    });
    const bool finished = line.run(host, begin + 60s);
    line.run_until(line.now());  // the device's own `sent` is at the same time
    Collector collector;
    conversation.report(collector);
    Ended ended{.error = std::string(finished ? text_of(conversation.error()).name : "hangs"),
                .detail = std::string(conversation.detail()),
                .advice = std::string(conversation.advice()),
                .fields = collector.fields,
                .reading = {},
                .took = line.now() - begin};
    if (conversation.reading() != nullptr) ended.reading = *conversation.reading();
    return ended;
  }
  /// The same with answers of `tamper`; `asked` is what it was asked.
  Ended run_tampered(const Tamper& tamper, std::string_view name, const std::vector<std::int64_t>& arguments = {}) {
    tampered.tamper = tamper;
    tampered.log.clear();
    const Ended ended = run(name, arguments);
    tampered.tamper = nullptr;
    line.run_until(line.now() + 1s);
    return ended;
  }
  std::string raw(const std::string& request) {
    RawHost host(request);
    line.run(line.attach(sim::Role::host, host), line.now() + 60s);
    line.run_until(line.now());
    return host.reply;
  }

  Options options;
  TestShaft shaft;
  std::vector<std::byte> host_storage = std::vector<std::byte>(unit.host_storage);
  std::vector<std::byte> device_storage = std::vector<std::byte>(unit.device_storage);
  Device<std::uint8_t>& device = *unit.device(options, shaft, device_storage).bytes;
  Tampered tampered{device};
  sim::Line<std::uint8_t> line{LinkKind::full_duplex, line_settings};
};

}  // namespace absenc::e201::testing
