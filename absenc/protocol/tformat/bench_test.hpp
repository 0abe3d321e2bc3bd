// SPDX-License-Identifier: Apache-2.0
// For tests: a virtual Smart-Abs and a host on one line in virtual time.
#pragma once

#include <algorithm>
#include <vector>

#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::tformat::testing {

using TestShaft = sim::testing::TestShaft<17>;

struct RawHost final : sim::testing::RawHost {
  explicit RawHost(std::vector<std::uint8_t> request, Time at = {})
      : sim::testing::RawHost(std::move(request), 100us, 12us, at) {}
};

struct Bench {
  explicit Bench(const Format& bench_format = {}) : format(bench_format), encoder(bench_format, shaft) {
    encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line.attach(sim::Role::device, encoder);
  }

  /// Runs a conversation to its end and returns it.
  template <class Conversation>
  Conversation& run(Conversation& conversation) {
    if (host == none) {
      host = line.attach(sim::Role::host, conversation);
    } else {
      line.replace(host, conversation);
    }
    finished = line.run(host, line.now() + std::chrono::seconds(10));
    return conversation;
  }
  std::vector<std::uint8_t> raw(std::vector<std::uint8_t> request) {
    RawHost raw_host(std::move(request), line.now());
    return run(raw_host).reply;
  }
  Reply everything() {
    ReadPosition read(format);
    run(read);
    return read.reply();
  }
  void pass(Time time) { line.run_until(line.now() + time); }

  static constexpr std::size_t none = ~std::size_t{0};
  Format format;
  TestShaft shaft;
  VirtualEncoder encoder;
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
  std::size_t host = none;
  bool finished = true;
};

}  // namespace absenc::tformat::testing
