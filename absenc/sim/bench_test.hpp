// SPDX-License-Identifier: Apache-2.0
// Helpers for the tests of units: a shaft, a host that sends any bytes, rates of faults.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "absenc/core/shaft.hpp"
#include "absenc/link/step.hpp"
#include "absenc/sim/faults.hpp"

namespace absenc::sim::testing {

/// A shaft whose position and speed a test can set; the speed is constant until it is set again.
template <unsigned singleturn_bits>
struct TestShaft final : Shaft {
  [[nodiscard]] ShaftState at(Time time) const override {
    ShaftState state = start;
    const double revolutions = state.speed_millirpm / 60'000.0 * std::chrono::duration<double>(time - since).count();
    state.position += static_cast<std::int64_t>(revolutions * 4294967296.0);
    return state;
  }
  /// Sets the position at the time of the last `spin`: whole turns, and counts within the turn.
  void put(std::int64_t turns, std::int64_t counts) {
    start.position = (turns << 32) + (counts << (32 - singleturn_bits));
  }
  void spin(std::int32_t rpm, Time now) {
    start.position = at(now).position;
    since = now;
    start.speed_millirpm = rpm * 1000;
  }

  ShaftState start{};
  Time since{};
};

/// A host that sends one request of any bytes and stores the reply.
class RawHost : public Machine<std::uint8_t> {
 public:
  RawHost(std::vector<std::uint8_t> request, Time answer, Time gap, Time at)
      : request_(std::move(request)), answer_(answer), gap_(gap), at_(at) {}

  void feed(const Event<std::uint8_t>& event) final {
    if (event.kind == Event<std::uint8_t>::Kind::sent) sent_at = event.at;
    if (event.kind == Event<std::uint8_t>::Kind::received) {
      if (reply.empty()) first_byte_at = event.at;
      reply.insert(reply.end(), event.items.begin(), event.items.end());
    }
    if (event.kind == Event<std::uint8_t>::Kind::silence) done_ = true;
  }
  Step<std::uint8_t> next(Time) final {
    using Kind = Step<std::uint8_t>::Kind;
    if (done_) return {.kind = Kind::done};
    if (sending_) return {.at = never, .answer = answer_, .gap = gap_};
    sending_ = true;
    return {.kind = Kind::transfer, .out = request_, .at = at_};
  }

  std::vector<std::uint8_t> reply;
  Time sent_at{};
  Time first_byte_at{};

 private:
  std::vector<std::uint8_t> request_;
  Time answer_;
  Time gap_;
  Time at_;
  bool sending_ = false;
  bool done_ = false;
};

/// Returns the probabilities of faults in replies: `share` for flipped bits, a fifth of `share` for each other fault.
inline FaultRates damaged_replies(double share) {
  FaultRates rates;
  for (const FaultKind kind : {FaultKind::drop, FaultKind::truncate, FaultKind::delay, FaultKind::echo,
                               FaultKind::garbage, FaultKind::silence, FaultKind::repeat}) {
    rates[kind] = share / 5;
  }
  rates[FaultKind::corrupt] = share;
  return rates;
}

}  // namespace absenc::sim::testing
