// SPDX-License-Identifier: Apache-2.0
// For the tests of the T-format: a virtual Smart-Abs and a host on one line in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <concepts>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/protocol/tformat/unit.hpp"

namespace absenc::tformat::testing {

using author::testing::Numbers;
using author::testing::PowerOn;
using author::testing::RunResult;
using author::testing::Tamper;
using author::testing::wire;
using author::testing::Wire;
using Talk = author::testing::Talk<std::uint8_t>;
using TestShaft = sim::testing::TestShaft<17>;

inline Wire wire(const Reply& reply) { return wire(encode_reply(reply).view()); }
inline Wire wire(const Request& request) { return wire(encode_request(request).view()); }

struct RawHost final : sim::testing::RawHost {
  explicit RawHost(Wire request, Time at = {}) : sim::testing::RawHost(std::move(request), 100us, 12us, at) {}
};

/// Returns a function that puts a refusal in place of each reply of the encoder whose number, counted from 0, is at
/// least `from` and less than `to`.
inline Tamper refuse(unsigned from, unsigned to, std::uint8_t alarm) {
  return [=](unsigned index, Wire& reply) {
    if (index >= from && index < to) reply = wire(Reply{.status = alarm, .encoder_id = 0x11});
  };
}

struct Bench : author::testing::UnitBench<17> {
  explicit Bench(Tamper tamper = {}) : UnitBench(tformat::unit, "") { tampered.replies(std::move(tamper)); }
  /// Runs the conversation `host` to its end and returns it.
  template <std::derived_from<Machine<std::uint8_t>> Host>
  Host& run(Host& host) {
    EXPECT_TRUE(line.converse(host));
    return host;
  }
  using UnitBench::run;
  Wire raw(Wire request) { return UnitBench::raw(std::move(request), 100us, 12us).reply; }
  Reply everything() {
    ReadPosition read({});
    return run(read).reply();
  }
  VirtualEncoder& encoder = static_cast<VirtualEncoder&>(device);
};

inline void reset(Bench& bench, DataId id, unsigned times = reset_requests) {
  for (unsigned i = 0; i < times; ++i) {
    EXPECT_EQ(bench.raw({control_field(id)}).size(), 6u);
    bench.pass(40us);
  }
}

}  // namespace absenc::tformat::testing
