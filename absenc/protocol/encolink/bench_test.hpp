// SPDX-License-Identifier: Apache-2.0
// For tests: a virtual AksIM-2 and a host on one wire in virtual time.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absenc/protocol/encolink/device.hpp"
#include "absenc/protocol/encolink/host.hpp"
#include "absenc/protocol/encolink/listen.hpp"
#include "absenc/protocol/encolink/procedures.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::encolink::testing {

inline constexpr Format single{.resolution = 20, .multiturn_bits = 0};
inline constexpr Format multi{.resolution = 20, .multiturn_bits = 16};

using TestShaft = sim::testing::TestShaft<20>;

/// Changes what the encoder sends; by default nothing. `frame` counts replies from 0.
class Tampered final : public Machine<std::uint8_t> {
 public:
  using Tamper = std::function<void(unsigned frame, std::vector<std::uint8_t>& reply)>;
  explicit Tampered(VirtualEncoder& encoder) : encoder_(encoder) {}
  void set(Tamper tamper) {
    tamper_ = std::move(tamper);
    frames_ = 0;
  }

  void feed(const Event<std::uint8_t>& event) override { encoder_.feed(event); }
  Step<std::uint8_t> next(Time now) override {
    for (;;) {
      Step<std::uint8_t> step = encoder_.next(now);
      if (step.kind != Step<std::uint8_t>::Kind::transfer || !tamper_) return step;
      out_.assign(step.out.begin(), step.out.end());
      tamper_(frames_++, out_);
      step.out = out_;
      if (!out_.empty()) return step;
      encoder_.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});  // nothing comes out
    }
  }

 private:
  VirtualEncoder& encoder_;
  Tamper tamper_;
  unsigned frames_ = 0;
  std::vector<std::uint8_t> out_;
};

struct Fields final : FieldSink {
  void put(const FieldValue& value) override {
    const std::string name(value.info->name);
    numbers[name] = value.number;
    reals[name] = value.real;
    texts[name] = std::string(value.bytes.begin(), value.bytes.end());
  }
  std::map<std::string, std::int64_t> numbers;
  std::map<std::string, double> reals;
  std::map<std::string, std::string> texts;
};

inline Fields report(const Conversation<std::uint8_t>& conversation) {
  Fields fields;
  conversation.report(fields);
  return fields;
}

struct Bench {
  explicit Bench(const Format& bench_format = multi, Wire bench_wire = Wire::uart, const Build& build = {})
      : format(bench_format), wire(bench_wire), encoder(bench_format, bench_wire, shaft, build) {
    shaft.put(7, 0x12345);
    encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line.attach(sim::Role::device, device);
  }

  /// Runs a conversation to its end and returns it. `on_emit` is called at every emit.
  template <class Conversation>
  Conversation& run(Conversation& conversation, const std::function<void()>& on_emit = {}) {
    emits = 0;
    hook = on_emit;
    const Time start = line.now();
    const auto emitted = [this] {
      ++emits;
      if (hook) hook();
      return true;
    };
    host = line.attach(sim::Role::host, conversation, emitted);
    finished = line.run(host, line.now() + std::chrono::seconds(60));
    took = line.now() - start;
    return conversation;
  }
  /// The same with a conversation that is made of this bench's format and wire.
  template <class Conversation, class... Parameters>
  Conversation conversed(Parameters... parameters) {
    Conversation conversation(format, wire, parameters...);
    run(conversation);
    return conversation;
  }
  void pass(Time time) { line.run_until(line.now() + time); }

  Format format;
  Wire wire;
  TestShaft shaft;
  VirtualEncoder encoder;
  Tampered device{encoder};
  sim::Line<std::uint8_t> line{wire == Wire::spi ? LinkKind::exchange : LinkKind::full_duplex,
                               wire == Wire::spi ? spi_settings : uart_settings};
  std::size_t host = 0;
  std::function<void()> hook;
  unsigned emits = 0;
  Time took{};
  bool finished = true;
};

}  // namespace absenc::encolink::testing
