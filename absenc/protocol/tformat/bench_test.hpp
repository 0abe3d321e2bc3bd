// SPDX-License-Identifier: Apache-2.0
// For tests: a virtual Smart-Abs and a host on one line in virtual time.
#pragma once

#include <algorithm>
#include <vector>

#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::tformat::testing {

/// A shaft that can be grabbed: constant speed from where it was put.
struct TestShaft final : Shaft {
  [[nodiscard]] ShaftState at(Time time) const override {
    ShaftState state = start;
    const double revolutions = state.speed_millirpm / 60'000.0 * std::chrono::duration<double>(time - since).count();
    state.position += static_cast<std::int64_t>(revolutions * 4294967296.0);
    return state;
  }
  /// `counts` of 17 bits after `turns` whole turns.
  void put(std::int64_t turns, std::int64_t counts) { start.position = (turns << 32) + (counts << 15); }
  void spin(std::int32_t rpm, Time now) {
    start.position = at(now).position;
    since = now;
    start.speed_millirpm = rpm * 1000;
  }

  ShaftState start{};
  Time since{};
};

/// Sends any bytes and keeps what comes back until the line is silent.
class RawHost final : public Machine<std::uint8_t> {
 public:
  explicit RawHost(std::vector<std::uint8_t> request, Time at = {}) : request_(std::move(request)), at_(at) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::sent) sent_at = event.at;
    if (event.kind == Event<std::uint8_t>::Kind::received) {
      if (reply.empty()) first_byte_at = event.at;
      reply.insert(reply.end(), event.items.begin(), event.items.end());
    }
    if (event.kind == Event<std::uint8_t>::Kind::silence) done_ = true;
  }
  Step<std::uint8_t> next(Time) override {
    using Kind = Step<std::uint8_t>::Kind;
    if (done_) return {.kind = Kind::done};
    if (sending_) return {.at = never, .answer = 100us, .gap = 12us};
    sending_ = true;
    return {.kind = Kind::transfer, .out = request_, .at = at_};
  }

  std::vector<std::uint8_t> reply;
  Time sent_at{};
  Time first_byte_at{};

 private:
  std::vector<std::uint8_t> request_;
  Time at_;
  bool sending_ = false;
  bool done_ = false;
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
