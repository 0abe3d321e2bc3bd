// SPDX-License-Identifier: Apache-2.0
// A virtual EnDat encoder with a host on a simulated line.
#pragma once

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/endat/device.hpp"
#include "absenc/protocol/endat/procedures.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::endat::testing {

/// A shaft that stands at a place that the test sets.
struct SetShaft final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override { return {.position = place}; }
  std::int64_t place = 0;  // in 2^-32 revolution
};

/// A virtual encoder on a line, on which conversations run one after the other.
struct Bench {
  explicit Bench(const Format& format, const EncoderTimes& times = {})
      : encoder(format, shaft, times), line(LinkKind::clocked_bidirectional, format.line()) {
    line.attach(sim::NodeRole::device, encoder);
    encoder.power_on(line.now(), Device<std::uint8_t>::PowerOn::skip);
    node = line.attach(sim::NodeRole::host, idle);
  }
  // Runs a conversation to its end.
  void run(Machine<std::uint8_t>& host) {
    line.replace(node, host);
    line.run(node, line.now() + 10s);
    line.replace(node, idle);
  }

  struct Idle final : Machine<std::uint8_t> {
    void feed(const ByteEvent&) override {}
    ByteStep next(Time) override { return {.kind = ByteStep::Kind::done}; }
  };
  SetShaft shaft;
  VirtualEncoder encoder;
  sim::Line<std::uint8_t> line;
  Idle idle;
  std::size_t node = 0;
};

/// A host that sends one request.
class Ask final : public author::HostOf<Protocol> {
 public:
  Ask(const Format& format, const Request& request) : HostOf(format) { ask(request); }

 private:
  void concluded(Error error) override { finish(error); }
};

}  // namespace absenc::endat::testing
