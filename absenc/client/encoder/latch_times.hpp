// SPDX-License-Identifier: Apache-2.0
// Computes bounds of the times at which readings were latched.
#pragma once

#include <algorithm>
#include <cstdint>

#include "absenc/client/port/watched_port.hpp"
#include "absenc/core/angle.hpp"
#include "absenc/host/latch_time.hpp"

namespace absenc::client {

/// Returns bounds of the latch time of a reading that was requested. `character` is the duration of a character; 0: not
/// known.
template <class Item>
[[nodiscard]] host::LatchTime asked_latch_time(const LineExchange<Item>& exchange, Time latched, Time character) {
  // The encoder latches before the request ends if the host clocks the bits or triggers the encoder by a pulse.
  const Time earliest = std::min(exchange.sent_at, latched) - exchange.sent_late;
  // The encoder latched before its reply began: subtracts from the arrival of the reply 15/16 of the duration of all
  // its characters but one. The last character may be reported before its stop bit ends, and the clocks of host and
  // encoder differ.
  const auto characters = static_cast<std::int64_t>(std::max<std::size_t>(exchange.reply().size(), 1)) - 1;
  const Time reply = characters * character * 15 / 16;
  return {earliest, std::max(earliest, exchange.received_at - reply)};
}

/// Estimates bounds of the latch times of unsolicited readings from the spread of their arrival times.
class ArrivalSpread {
 public:
  /// Adds the arrival of the next reading. No byte of it had arrived until `nothing_until`.
  void add(Time arrived, Time nothing_until) {
    const Time pause = arrived - std::max(arrived_, nothing_until);
    if (arrived_ == Time{}) usual_ = pause;
    if (arrived >= second_ends_) {
      before_ = arrived < second_ends_ + one_second ? now_ : Time{};
      now_ = {};
      second_ends_ = arrived + one_second;
    }
    now_ += std::max(pause - usual_ - usual_ / 4, Time{});
    usual_ += (pause - usual_) / average;
    arrived_ = arrived;
  }
  void restart() { *this = {}; }

  /// Returns the bounds of the time at which the last reading was latched.
  [[nodiscard]] host::LatchTime latch_time() const { return {arrived_ - usual_ - before_ - now_, arrived_}; }

 private:
  static constexpr Time one_second = std::chrono::seconds(1);
  static constexpr int average = 16;  // number of readings over which the usual pause between two readings is averaged

  Time arrived_{};
  Time usual_{};  // average pause between two unsolicited readings
  Time second_ends_{};
  Time now_{};  // sum of the times by which pauses in the present second were longer than 5/4 of the usual pause
  Time before_{};
};

}  // namespace absenc::client
