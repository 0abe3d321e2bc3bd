// SPDX-License-Identifier: Apache-2.0
// For tests: a virtual BiSS encoder and a host on one clocked line in virtual time.
#pragma once

#include <string>

#include "absenc/protocol/biss/device.hpp"
#include "absenc/protocol/biss/host.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::biss::testing {

/// A shaft that stays at the position in `state`.
struct TestShaft final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override { return state; }
  ShaftState state{};
};

/// A host that clocks one transfer of any number of bits and records the samples of SLO.
class RawHost final : public Machine<std::uint8_t> {
 public:
  RawHost(std::size_t bits, Time at, std::uint32_t rate) : bits_(bits), at_(at), rate_(rate) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind != Event<std::uint8_t>::Kind::received) return;
    for (std::size_t i = 0; i < bits_; ++i) text += BitView{event.items, bits_}[i] ? '1' : '0';
  }
  Step<std::uint8_t> next(Time) override {
    using Kind = Step<std::uint8_t>::Kind;
    switch (step_++) {
      case 0:
        return {.kind = Kind::configure, .rate = rate_};
      case 1:
        return {.kind = Kind::transfer, .bits = bits_, .at = at_};
      default:
        return text.empty() ? Step<std::uint8_t>{.at = never} : Step<std::uint8_t>{.kind = Kind::done};
    }
  }

  std::string text;

 private:
  std::size_t bits_;
  Time at_;
  std::uint32_t rate_;
  int step_ = 0;
};

/// A virtual encoder of type `Device` on a line, which several hosts use one after the other.
template <class Device>
struct ClockedBench {
  template <class Format, class... More>
  explicit ClockedBench(const LineSettings& settings, const Format& format, const More&... more)
      : encoder(format, shaft, more...), line(LinkKind::clocked, settings) {
    encoder.power_on(Time{}, absenc::Device<std::uint8_t>::PowerOn::skip);
    line.attach(sim::NodeRole::device, encoder);
  }

  template <class Host>
  Host& run(Host& host) {
    if (node == none) {
      node = line.attach(sim::NodeRole::host, host);
    } else {
      line.replace(node, host);
    }
    finished = line.run(node, line.now() + std::chrono::seconds(10));
    return host;
  }
  /// Clocks `bits` clocks after a pause and returns the samples of SLO.
  std::string clock(std::size_t bits, Time pause = std::chrono::milliseconds(1), std::uint32_t rate = 200'000) {
    RawHost host(bits, line.now() + pause, rate);
    return run(host).text;
  }
  [[nodiscard]] std::string_view last_rule() const {
    return encoder.violations().empty() ? "" : encoder.violations().back().rule;
  }

  static constexpr std::size_t none = ~std::size_t{0};
  TestShaft shaft;
  Device encoder;
  sim::Line<std::uint8_t> line;
  std::size_t node = none;
  bool finished = true;
};

using Bench = ClockedBench<VirtualEncoder>;

}  // namespace absenc::biss::testing
