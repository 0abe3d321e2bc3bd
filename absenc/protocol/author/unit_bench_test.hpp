// SPDX-License-Identifier: Apache-2.0
// For the tests of units of characters: the virtual encoder and the unit's commands on one line in virtual time.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "absenc/protocol/author/text.hpp"
#include "absenc/protocol/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::author::testing {

using namespace std::chrono_literals;

/// How a command ended, and what it told: real numbers rounded among the numbers.
struct Told : FieldSink {
  void put(const FieldValue& value) override {
    const std::string name(value.info->name);
    const bool is_real = value.info->kind == FieldInfo::Kind::real;
    numbers[name] = is_real ? static_cast<std::int64_t>(value.real) : value.number;
    texts[name] = std::string(value.bytes.begin(), value.bytes.end());
  }
  void take(const Conversation<std::uint8_t>& conversation) {
    error = conversation.error();
    detail = conversation.detail();
    advice = conversation.advice();
    if (const Reading* const now = conversation.reading()) reading = *now;
    conversation.report(*this);
  }
  Error error = Error::none;
  std::string detail;
  std::string advice;
  std::optional<Reading> reading;
  std::map<std::string, std::int64_t> numbers;
  std::map<std::string, std::string> texts;
  bool finished = false;
  unsigned emits = 0;
  std::uint64_t frames = 0;  // that the encoder answered
  Time took{};
};

/// "name=value name=value".
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

/// Changes what the encoder hears and what it sends; by default nothing. `nth` counts from 0.
class Tampered final : public Machine<std::uint8_t> {
 public:
  using Bytes = std::vector<std::uint8_t>;
  using Tamper = std::function<void(unsigned nth, Bytes& bytes)>;
  explicit Tampered(Machine<std::uint8_t>& encoder) : encoder_(encoder) {}
  void requests(Tamper tamper) { requests_ = {std::move(tamper)}; }
  void replies(Tamper tamper) { replies_ = {std::move(tamper)}; }

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind != Event<std::uint8_t>::Kind::received || !requests_.tamper) return encoder_.feed(event);
    Bytes items(event.items.begin(), event.items.end());
    requests_.tamper(requests_.count++, items);
    Event<std::uint8_t> changed = event;
    changed.items = items;
    encoder_.feed(changed);
  }
  Step<std::uint8_t> next(Time now) override {
    for (;;) {
      Step<std::uint8_t> step = encoder_.next(now);
      if (step.kind != Step<std::uint8_t>::Kind::transfer || !replies_.tamper) return step;
      out_.assign(step.out.begin(), step.out.end());
      replies_.tamper(replies_.count++, out_);
      step.out = out_;
      if (!out_.empty()) return step;
      encoder_.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});  // nothing comes out
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
  Bytes out_;
};

template <unsigned singleturn_bits>
struct UnitBench {
  using PowerOn = Device<std::uint8_t>::PowerOn;
  using OnEmit = std::function<void(Conversation<std::uint8_t>&)>;

  UnitBench(const Unit& of, std::string_view settings) : unit(of), options(options_of(of, settings)) {
    device.power_on(Time{}, PowerOn::skip);
    line.attach(sim::Role::device, tampered);
  }

  Conversation<std::uint8_t>& make(std::string_view name, std::vector<std::int64_t> arguments = {}) {
    const Command& command = *find_command(unit, name);
    for (std::size_t i = arguments.size(); i < command.arguments.size(); ++i) {
      arguments.push_back(command.arguments[i].default_value);
    }
    return *unit.host(options, command, arguments, host_storage).bytes;
  }
  /// A command of the unit to its end, told what `options` say. `on_emit` is called at every emit.
  Told run(std::string_view name, const std::vector<std::int64_t>& arguments = {}, const OnEmit& on_emit = {}) {
    return run(make(name, arguments), on_emit);
  }
  Told run(Conversation<std::uint8_t>& conversation, const OnEmit& on_emit = {}) {
    Told told;
    const Time begin = line.now();
    const std::uint64_t before = device.answered();
    const std::size_t host = line.attach(sim::Role::host, conversation, [&] {
      ++told.emits;
      if (on_emit) on_emit(conversation);
      return true;
    });
    told.finished = line.run(host, begin + 60s);
    line.run_until(line.now());  // the device's own `sent` is at the same time
    told.take(conversation);
    told.frames = device.answered() - before;
    told.took = line.now() - begin;
    return told;
  }
  /// These bytes, not before 5 us have passed; and what comes back until the line is silent.
  sim::testing::RawHost raw(std::vector<std::uint8_t> request, Time answer = 50ms, Time gap = 5ms) {
    sim::testing::RawHost host(std::move(request), answer, gap, line.now() + 5us);
    line.run(line.attach(sim::Role::host, host), line.now() + 60s);
    line.run_until(line.now());
    return host;
  }
  void tell(std::string_view settings) { options = options_of(unit, settings); }
  void pass(Time time) { line.run_until(line.now() + time); }
  void restart(PowerOn kind) {
    device.power_off(line.now());
    device.power_on(line.now(), kind);
  }
  void condition(std::size_t index, std::int64_t value) { device.set_condition(index, value, line.now()); }
  [[nodiscard]] std::string first_violation() const {
    return std::string(device.violations().empty() ? "" : device.violations()[0].rule);
  }

  const Unit& unit;
  Options options;
  sim::testing::TestShaft<singleturn_bits> shaft;
  std::vector<std::byte> host_storage = std::vector<std::byte>(unit.host_storage);
  std::vector<std::byte> device_storage = std::vector<std::byte>(unit.device_storage);
  Device<std::uint8_t>& device = *unit.device(options, shaft, device_storage).bytes;
  Tampered tampered{device};
  sim::Line<std::uint8_t> line{unit.link, unit.settings(options)};
};

}  // namespace absenc::author::testing
