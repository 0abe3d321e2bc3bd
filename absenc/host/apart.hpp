// SPDX-License-Identifier: Apache-2.0
// Upper limit of the time between two readings, also where only their arrival times are known.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// The meaning of `Reading::latched`: the time at which the position was latched, or at which the reply arrived.
enum class Times : std::uint8_t { latched, arrived };

/// Returns whether the encoder with these options may transmit readings without a request.
[[nodiscard]] constexpr bool sends_unsolicited(const Unit& unit, const Options& options) {
  return unit.link == LinkKind::can || (unit.streams != nullptr && unit.streams(options));
}

/// Calculates an upper limit of the time between two consecutive readings of one encoder.
class Apart {
 public:
  /// Makes the calculation. `times` states whether the times of the readings are those of latching or of arrival.
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
