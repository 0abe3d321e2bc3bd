// SPDX-License-Identifier: Apache-2.0
// What is not known of an asynchronous line, found from its level changes: the baud rate and the idle level.
#pragma once

#include <optional>

#include "absenc/capture/lines/async.hpp"

namespace absenc::capture {

enum class Idle : std::uint8_t { automatic, low, high };

/// What the user knows of a line.
struct AsyncSettings {
  double baud = 0;  // 0: found from the changes
  Parity parity = Parity::none;
  unsigned stop_bits = 1;
  Idle idle = Idle::automatic;  // low: an inverted line
  Tick glitch = 0;              // a level that lasts for less is taken for noise; 0: none is
};

/// From the first changes of a line, which was seen from `first` to `end`. Each bit time that its pulses could be
/// multiples of is tried, with each idle level, and that is taken which leads to the fewest errors; of equal ones the
/// longest bit. It is then measured from start bit to last change. Nothing: too few changes to find the baud rate, or
/// every second character would be wrong. `ticks_per_second` is needed when the baud rate is given.
std::optional<AsyncFormat> find_format(const Changes& changes, Tick first, Tick end, const AsyncSettings& settings,
                                       std::uint64_t ticks_per_second);

}  // namespace absenc::capture
