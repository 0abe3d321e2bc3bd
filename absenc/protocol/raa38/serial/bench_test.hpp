// SPDX-License-Identifier: Apache-2.0
// For tests: virtual RAA38S6 and a host on one asynchronous line in virtual time.
#pragma once

#include <functional>
#include <list>
#include <map>
#include <string>
#include <vector>

#include "absenc/protocol/raa38/serial/device.hpp"
#include "absenc/protocol/raa38/serial/listen.hpp"
#include "absenc/protocol/raa38/serial/timing.hpp"
#include "absenc/protocol/raa38/talk_test.hpp"
#include "absenc/protocol/raa38/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::raa38::serial::testing {

inline constexpr LineSettings line_of_tests{.rate = 115'200};

using Shaft14 = sim::testing::TestShaft<14>;

[[nodiscard]] inline Options options_of(const Format& format) {
  Options options;
  options.values = {static_cast<std::int64_t>(format.mode),
                    format.bits,
                    format.unit,
                    static_cast<std::int64_t>(format.second_byte),
                    static_cast<std::int64_t>(format.zeroing),
                    format.zero_unit,
                    format.refresh_millihertz,
                    format.maximum_rpm,
                    format.acquisition.count(),
                    format.transmission.count()};
  return options;
}

/// A command of an encoder of this format.
struct Talk final : raa38::testing::Talk<std::uint8_t> {
  Talk(const Format& format, std::string_view name)
      : raa38::testing::Talk<std::uint8_t>(serial_unit, options_of(format), name, {}) {}
};

struct Fields final : FieldSink {
  void put(const FieldValue& value) override {
    numbers[std::string(value.info->name)].push_back(value.number);
    reals[std::string(value.info->name)] = value.real;
  }
  std::map<std::string, std::vector<std::int64_t>> numbers;
  std::map<std::string, double> reals;
};

inline Fields report(const Conversation<std::uint8_t>& conversation) {
  Fields fields;
  conversation.report(fields);
  return fields;
}

/// Changes what a device sends, by default nothing. `frame` counts from 0; nothing left: nothing is sent.
class Tampered final : public Machine<std::uint8_t> {
 public:
  using Tamper = std::function<void(unsigned frame, std::vector<std::uint8_t>& reply)>;
  explicit Tampered(Machine<std::uint8_t>& device) : device_(device) {}
  void set(Tamper tamper) {
    tamper_ = std::move(tamper);
    frames_ = 0;
  }
  void feed(const Event<std::uint8_t>& event) override { device_.feed(event); }
  Step<std::uint8_t> next(Time now) override {
    for (;;) {
      Step<std::uint8_t> step = device_.next(now);
      if (step.kind != Step<std::uint8_t>::Kind::transfer || !tamper_) return step;
      out_.assign(step.out.begin(), step.out.end());
      tamper_(frames_++, out_);
      step.out = out_;
      if (!out_.empty()) return step;
      device_.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    }
  }

 private:
  Machine<std::uint8_t>& device_;
  Tamper tamper_;
  unsigned frames_ = 0;
  std::vector<std::uint8_t> out_;
};

struct Bench {
  explicit Bench(const Format& bench_settings, LinkKind kind = LinkKind::half_duplex)
      : settings(bench_settings), line(kind, line_of_tests) {
    shaft.put(0, 383);
    add(settings);
  }

  /// One more encoder on the line, on the same shaft.
  VirtualEncoder& add(const Format& of_it) {
    encoders.emplace_back(of_it, shaft);
    encoders.back().power_on(line.now(), Device<std::uint8_t>::PowerOn::skip);
    devices.emplace_back(encoders.back());
    line.attach(sim::Role::device, devices.back());
    return encoders.back();
  }
  VirtualEncoder& encoder() { return encoders.front(); }
  Tampered& device() { return devices.front(); }

  /// To its end, or until `on_emit` returns false.
  template <class Conversation>
  Conversation& run(Conversation& conversation, const std::function<bool()>& on_emit = {}) {
    const Time start = line.now();
    const auto emitted = [on_emit] { return !on_emit || on_emit(); };
    const auto host = line.attach(sim::Role::host, conversation, emitted);
    finished = line.run(host, line.now() + std::chrono::seconds(60));
    took = line.now() - start;
    line.replace(host, idle);
    return conversation;
  }

  struct Idle final : Machine<std::uint8_t> {
    void feed(const Event<std::uint8_t>&) override {}
    Step<std::uint8_t> next(Time) override { return {}; }
  };

  Format settings;
  Shaft14 shaft;
  sim::Line<std::uint8_t> line;
  std::list<VirtualEncoder> encoders;
  std::list<Tampered> devices;
  Idle idle;
  Time took{};
  bool finished = true;
};

}  // namespace absenc::raa38::serial::testing
