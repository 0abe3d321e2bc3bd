// SPDX-License-Identifier: Apache-2.0
// Upper limit of the time between two readings, also where only their arrival times are known.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// The meaning of `Reading::latched`: the time of the latching, or that of the arrival.
enum class Times : std::uint8_t { latched, arrived };

/// Returns whether this encoder may transmit unsolicited.
[[nodiscard]] constexpr bool sends_unsolicited(const Unit& unit, const Options& options) {
  return unit.link == LinkKind::can || (unit.streams != nullptr && unit.streams(options));
}

/// Calculates an upper limit of the time between two consecutive readings of one encoder.
class Apart {
 public:
  /// `times` is the meaning of the times that are added.
  explicit constexpr Apart(Times times) : times_(times) {}

  /// Returns the longest time that can lie between the last added reading and one at `latched`.
  [[nodiscard]] constexpr Time since_last(Time latched) const { return has_waited(latched) ? latched - last_ : wait_; }

  /// Adds a reading with the time `latched`.
  constexpr void add(Time latched) {
    if (started_ && has_waited(latched)) {
      wait_ = latched - last_;
      wait_counts_until_ = latched + wait_;
    }
    last_ = latched;
    started_ = true;
  }

 private:
  [[nodiscard]] constexpr bool has_waited(Time latched) const {
    return times_ == Times::latched || latched - last_ >= wait_ || latched >= wait_counts_until_;
  }

  Times times_;
  bool started_ = false;
  Time last_{};
  Time wait_{};
  Time wait_counts_until_{};
};

}  // namespace absenc::host
