// SPDX-License-Identifier: Apache-2.0
// For tests: a virtual E201-9S and a host on one line in virtual time.
#pragma once

#include <string>
#include <vector>

#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/e201/device.hpp"
#include "absenc/protocol/e201/host.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::e201::testing {

using biss::testing::report;
using biss::testing::TestShaft;

inline Format biss_format(const PositionBits& bits = {.position = 19, .multiturn = 16}) {
  Format format;
  format.biss.word = biss::word_with_status(bits);
  return format;
}

inline Format ssi_format(ssi::AfterWord after = ssi::AfterWord::repeat) {
  Format format;
  format.carries = Carries::ssi;
  format.ssi = {.word = "multiturn:12 position:13 gray"_word, .after_word = after};
  return format;
}

/// Sends a text and keeps what comes back until the line is silent.
class RawHost final : public Machine<std::uint8_t> {
 public:
  RawHost(const std::string& request, Time at) : request_(request.begin(), request.end()), at_(at) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::received) reply.append(event.items.begin(), event.items.end());
    if (event.kind == Event<std::uint8_t>::Kind::silence) done_ = true;
  }
  Step<std::uint8_t> next(Time) override {
    using Kind = Step<std::uint8_t>::Kind;
    if (done_) return {.kind = Kind::done};
    if (sending_) return {.at = never, .answer = 50ms, .gap = 5ms};
    sending_ = true;
    return {.kind = Kind::transfer, .out = request_, .at = at_};
  }

  std::string reply;

 private:
  std::vector<std::uint8_t> request_;
  Time at_;
  bool sending_ = false;
  bool done_ = false;
};

struct Bench {
  explicit Bench(const Format& bench_format = biss_format(), const AdapterSettings& settings = {})
      : format(bench_format), adapter(bench_format, shaft, settings) {
    adapter.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    device = line.attach(sim::Role::device, adapter);
  }

  template <class Conversation>
  Conversation& run(Conversation& conversation, const sim::Line<std::uint8_t>::OnEmit& on_emit = {}) {
    const std::size_t host = line.attach(sim::Role::host, conversation, on_emit);
    finished = line.run(host, line.now() + std::chrono::seconds(60));
    line.run_until(line.now());  // the adapter's own `sent` is at the same time
    return conversation;
  }
  std::string raw(const std::string& request) {
    RawHost host(request, line.now());
    return run(host).reply;
  }

  Format format;
  TestShaft shaft;
  VirtualAdapter adapter;
  sim::Line<std::uint8_t> line{LinkKind::full_duplex, line_settings};
  std::size_t device = 0;
  bool finished = true;
};

}  // namespace absenc::e201::testing
