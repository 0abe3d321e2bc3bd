// SPDX-License-Identifier: Apache-2.0
// Bench of a virtual encoder and its unit's commands on a line of characters, in virtual time.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absenc/protocol/author/text.hpp"
#include "absenc/protocol/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::author::testing {

using namespace std::chrono_literals;
using Wire = std::vector<std::uint8_t>;
using PowerOn = Device<std::uint8_t>::PowerOn;
using Numbers = std::map<std::string, std::int64_t>;

inline Wire wire(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

/// Result and fields of a command. `numbers` has also the fields with fractions, truncated to integers.
struct RunResult : FieldSink {
  void put(const FieldValue& value) override {
    const std::string name(value.info->name);
    const bool is_real = value.info->kind == FieldInfo::Kind::real;
    numbers[name] = is_real ? static_cast<std::int64_t>(value.real) : value.number;
    if (!value.bytes.empty()) texts[name] = std::string(value.bytes.begin(), value.bytes.end());
  }
  void take(const Conversation<std::uint8_t>& conversation) {
    error = conversation.error();
    detail = conversation.detail();
    advice = conversation.advice();
    change = conversation.change_sent();
    note = conversation.change_note();
    if (const Reading* const now = conversation.reading()) reading = *now;
    conversation.report(*this);
    sent = wire(conversation.exchange().sent);
    received_at = conversation.exchange().received_at;
  }
  [[nodiscard]] bool says(std::string_view words) const { return detail.find(words) != std::string::npos; }

  Error error = Error::none;
  std::string detail;
  std::string advice;
  ChangeSent change = ChangeSent::no;
  std::string note;  // what the conversation noted of its change
  std::optional<Reading> reading;
  Numbers numbers;
  std::map<std::string, std::string> texts;
  Wire sent;  // request of the last exchange
  Time received_at{};
  bool finished = false;
  unsigned emits = 0;
  std::uint64_t frames = 0;  // number of requests that the encoder served during the command
  Time took{};
};

/// Returns the options of a text "name=value name=value". Throws std::logic_error if resolve_options refuses them.
inline Options options_of(const Unit& unit, std::string_view text) {
  std::vector<OptionText> settings;
  for_each_value(text, [&settings](std::string_view name, std::string_view value) {
    settings.push_back({name, value});
    return true;
  });
  Options options;
  if (resolve_options(unit, {}, settings, options).kind != OptionError::Kind::none)
    throw std::logic_error("no such option");
  return options;
}

/// Returns the option values of a format.
template <class Declared, class Format>
requires requires(const Declared& declared) { declared.infos; }
Options options_of(const Declared& declared, const Format& format) {
  Options options;
  for (std::size_t i = 0; i < declared.infos.size(); ++i) options.values[i] = declared.get(format, i);
  return options;
}

/// Collects the rules that a virtual encoder reports as broken, in order of time.
struct BrokenRules final : RuleWatch {
  void looked(std::string_view rule, bool kept) override {
    if (!kept) rules.emplace_back(rule);
  }
  std::vector<std::string> rules;
};

/// A conversation for a command, with its storage; arguments that the test leaves out have their defaults.
template <class Item>
class Talk {
 public:
  Talk(const Unit& unit, const Options& options, std::string_view name, std::vector<std::int64_t> arguments = {})
      : storage_(unit.host_storage) {
    const Command& command = *find_command(unit, name);
    for (std::size_t i = arguments.size(); i < command.arguments.size(); ++i) {
      arguments.push_back(command.arguments[i].default_value);
    }
    made_ = unit.host(options, command, arguments, storage_).template of<Item>();
  }
  Conversation<Item>& operator*() const { return *made_; }
  Conversation<Item>* operator->() const { return made_; }

 private:
  std::vector<std::byte> storage_;
  Conversation<Item>* made_ = nullptr;
};

/// Function that changes the bytes of a received event or a sent frame; `nth` is its number, from 0.
using Tamper = std::function<void(unsigned nth, Wire& bytes)>;

/// A virtual encoder with functions that change the bytes that it receives and sends.
class Tampered final : public Machine<std::uint8_t> {
 public:
  explicit Tampered(Machine<std::uint8_t>& encoder) : encoder_(encoder) {}
  void requests(Tamper tamper) { requests_ = {std::move(tamper)}; }
  void replies(Tamper tamper) { replies_ = {std::move(tamper)}; }

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind != Event<std::uint8_t>::Kind::received || !requests_.tamper) return encoder_.feed(event);
    Wire items = wire(event.items);
    requests_.tamper(requests_.count++, items);
    Event<std::uint8_t> changed = event;
    changed.items = items;
    encoder_.feed(changed);
  }
  Step<std::uint8_t> next(Time now) override {
    for (;;) {
      Step<std::uint8_t> step = encoder_.next(now);
      if (step.kind != Step<std::uint8_t>::Kind::transfer || !replies_.tamper) return step;
      out_ = wire(step.out);
      replies_.tamper(replies_.count++, out_);
      step.out = out_;
      if (!out_.empty()) return step;
      encoder_.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});  // the encoder's frame is lost on the line
    }
  }

 private:
  struct Counted {
    Tamper tamper{};
    unsigned count = 0;
  };
  Machine<std::uint8_t>& encoder_;
  Counted requests_;
  Counted replies_;
  Wire out_;
};

/// A line in virtual time with at most one host, which is idle between conversations.
struct HostedLine : sim::Line<std::uint8_t> {
  HostedLine(LinkKind kind, const LineSettings& settings) : Line(kind, settings) {}

  void put_on(Machine<std::uint8_t>& host) {
    if (node) return replace(*node, host);
    node = attach(sim::NodeRole::host, host, [this] { return !on_emit || on_emit(); });
  }
  /// Runs a host, and returns whether its conversation ended within 60 s of virtual time.
  bool converse(Machine<std::uint8_t>& host) {
    put_on(host);
    const bool ended = run(*node, now() + 60s);
    // lets the device handle its `sent` event, which has the same time as the end of the conversation
    run_until(now());
    replace(*node, idle);
    return ended;
  }

  struct Idle final : Machine<std::uint8_t> {
    void feed(const Event<std::uint8_t>&) override {}
    Step<std::uint8_t> next(Time) override { return {.kind = Step<std::uint8_t>::Kind::done}; }
  };
  Idle idle{};
  std::optional<std::size_t> node{};
  std::function<bool()> on_emit{};
};

template <unsigned singleturn_bits>
struct UnitBench {
  using PowerOn = testing::PowerOn;
  using OnEmit = std::function<void(Conversation<std::uint8_t>&)>;

  UnitBench(const Unit& of, std::string_view settings) : UnitBench(of, options_of(of, settings)) {}
  UnitBench(const Unit& of, const Options& with) : unit(of), options(with) {
    device.power_on(Time{}, PowerOn::skip);
    line.attach(sim::NodeRole::device, tampered);
  }

  /// Runs a command to its end; a command that sends a request for each result ends at its first result.
  RunResult run(std::string_view name, const std::vector<std::int64_t>& arguments = {}, const OnEmit& on_emit = {}) {
    const Talk<std::uint8_t> talk(unit, options, name, arguments);
    return run(*talk, on_emit);
  }
  RunResult run(Conversation<std::uint8_t>& conversation, const OnEmit& on_emit = {}) {
    RunResult told;
    const Time begin = line.now();
    const std::uint64_t before = device.answer_count();
    line.on_emit = [&] {
      ++told.emits;
      if (on_emit) on_emit(conversation);
      return !conversation.asks();
    };
    told.finished = line.converse(conversation) || conversation.asks();
    line.on_emit = {};
    told.take(conversation);
    told.frames = device.answer_count() - before;
    told.took = line.now() - begin;
    return told;
  }
  /// Runs a conversation that streams; `go_on()` returns after each result whether to continue.
  void listen(Conversation<std::uint8_t>& conversation, const std::function<bool()>& go_on) {
    line.on_emit = go_on;
    line.converse(conversation);
    line.on_emit = {};
  }
  /// Sends these bytes in one transfer, and returns the host with the bytes that it received.
  sim::testing::RawHost raw(Wire request, Time answer = 50ms, Time gap = 5ms) {
    sim::testing::RawHost host(std::move(request), answer, gap, line.now());
    line.converse(host);
    return host;
  }
  void tell(std::string_view settings) { options = options_of(unit, settings); }
  void pass(Time time) { line.run_until(line.now() + time); }
  void restart(PowerOn kind = PowerOn::skip) {
    device.power_off(line.now());
    device.power_on(line.now(), kind);
  }
  void condition(std::size_t index, std::int64_t value) { device.set_condition(index, value, line.now()); }
  [[nodiscard]] std::uint32_t violations() const { return device.violation_count(); }
  [[nodiscard]] std::string first_violation() const {
    return std::string(device.violations().empty() ? "" : device.violations()[0].rule);
  }

  const Unit& unit;
  Options options;
  sim::testing::TestShaft<singleturn_bits> shaft;
  std::vector<std::byte> device_storage = std::vector<std::byte>(unit.device_storage);
  Device<std::uint8_t>& device = *unit.device(options, shaft, device_storage).bytes;
  Tampered tampered{device};
  HostedLine line{unit.link, unit.settings(options)};
};

}  // namespace absenc::author::testing
