// SPDX-License-Identifier: Apache-2.0
// For tests: a virtual Smart-Abs and a host on one line in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <concepts>

#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/protocol/tformat/unit.hpp"
#include "tests/kit/bench.hpp"

namespace absenc::tformat::testing {

using kit::Numbers;
using kit::Outcome;
using kit::PowerOn;
using kit::Tamper;
using kit::wire;
using kit::Wire;
using TestShaft = sim::testing::TestShaft<17>;

inline Wire wire(const Reply& reply) { return wire(encode_reply(reply).view()); }
inline Wire wire(const Request& request) { return wire(encode_request(request).view()); }

struct RawHost final : sim::testing::RawHost {
  explicit RawHost(Wire request, Time at = {}) : sim::testing::RawHost(std::move(request), 100us, 12us, at) {}
};

/// Refusals in place of these replies.
inline Tamper refuse(unsigned from, unsigned to, std::uint8_t alarm) {
  return [=](unsigned index, Wire& reply) {
    if (index >= from && index < to) reply = wire(Reply{.status = alarm, .encoder_id = 0x11});
  };
}

inline Options default_options() {
  Options options;
  EXPECT_EQ(resolve_options(unit, {}, {}, options).kind, OptionError::Kind::none);
  return options;
}

struct Bench : kit::Bench<VirtualEncoder, TestShaft> {
  explicit Bench(Tamper tamper = {})
      : kit::Bench<VirtualEncoder, TestShaft>(tformat::unit, default_options(), Format{}, std::move(tamper)) {}
  /// Runs a conversation to its end and returns it.
  template <std::derived_from<Machine<std::uint8_t>> Host>
  Host& run(Host& host) {
    EXPECT_TRUE(line.converse(host));
    return host;
  }
  using kit::Bench<VirtualEncoder, TestShaft>::run;
  Reply everything() {
    ReadPosition read({});
    return run(read).reply();
  }
};

}  // namespace absenc::tformat::testing
