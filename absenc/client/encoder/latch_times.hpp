// SPDX-License-Identifier: Apache-2.0
// When readings were latched, as far as the times of their exchanges tell: bounds, not estimates.
#pragma once

#include <algorithm>
#include <cstdint>

#include "absenc/client/port/watched_port.hpp"
#include "absenc/core/angle.hpp"
#include "absenc/host/latch_time.hpp"

namespace absenc::client {

/// An encoder that was asked latches between the end of the request and the beginning of its reply. `character`: the
/// time of a character on the line; 0 where it is not known, or where bytes take no time. The delay that the document
/// gives between the request and the latching is the same each time and does not count.
template <class Item>
[[nodiscard]] host::LatchTime asked_latch_time(const LineExchange<Item>& exchange, Time latched, Time character) {
  // Before the end of the request it latches where the host clocks it, or where an earlier request asked for the
  // position.
  const Time earliest = std::min(exchange.sent_at, latched) - exchange.sent_late;
  // The last character may be reported before its stop bit has ended, and the clock of an encoder may be a little fast.
  const auto characters = static_cast<std::int64_t>(std::max<std::size_t>(exchange.reply().size(), 1)) - 1;
  const Time reply = characters * character * 15 / 16;
  return {earliest, std::max(earliest, exchange.received_at - reply)};
}

/// Readings that an encoder sends by itself: when one was latched, only the spread of their arrival tells. It was not
/// before the one before came, if that came in time; and in the last seconds they were late by no more than all pauses
/// together that were longer than usual.
class ArrivalSpread {
 public:
  /// `arrived` of a reading; nothing had come until `nothing_until`. In the order of their arrival.
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

  /// The latch time of the last reading.
  [[nodiscard]] host::LatchTime latch_time() const { return {arrived_ - usual_ - before_ - now_, arrived_}; }

 private:
  static constexpr Time one_second = std::chrono::seconds(1);
  static constexpr int average = 16;  // readings

  Time arrived_{};
  Time usual_{};  // pause between two readings
  Time second_ends_{};
  Time now_{};  // longer pauses of this second, what is longer of them
  Time before_{};
};

}  // namespace absenc::client
