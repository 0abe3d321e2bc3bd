// SPDX-License-Identifier: Apache-2.0
// How long two readings can have been apart at most, also where only their times of arrival are known.
#pragma once

#include <cstdint>

#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// When a reading was latched: known, or only that it came then. Those that had to wait come together.
enum class Times : std::uint8_t { latched, arrived };

/// An encoder that transmits by itself has no time but that of its arrival.
[[nodiscard]] constexpr bool sends_unsolicited(const Unit& unit, const Options& options) {
  return unit.link == LinkKind::can || (unit.streams != nullptr && unit.streams(options));
}

/// The time between readings, as they are used.
class Apart {
 public:
  /// Counts the times that `times` selects.
  explicit constexpr Apart(Times times) : times_(times) {}

  /// Readings that came together after a wait were taken during that wait, or while it was handed over, which takes
  /// less long.
  [[nodiscard]] constexpr Time since_last(Time latched) const { return has_waited(latched) ? latched - last_ : wait_; }

  /// Adds a reading that was latched at this time.
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
