// SPDX-License-Identifier: Apache-2.0
// Finds the baud rate and the idle level of an asynchronous line from its level changes.
#pragma once

#include <optional>

#include "absenc/capture/lines/async.hpp"

namespace absenc::capture {

enum class Idle : std::uint8_t { automatic, low, high };

/// Settings of an asynchronous line as far as the user knows them.
struct AsyncSettings {
  double baud = 0;  // baud rate in bits per second; 0: detected from the changes
  Parity parity = Parity::none;
  unsigned stop_bits = 1;
  Idle idle = Idle::automatic;  // `low` means an inverted line
  Tick glitch = 0;              // a level shorter than this is noise, in ticks; 0: no filter
  unsigned data_bits = 8;       // 5 to 16
};

/// Finds the format from the first changes of a line between `first` and `end`. It tries the given baud rate, or
/// without one the bit times of which each of the shortest groups of pulses could be 1 to 4 bits, with each idle level
/// that `settings` allow. It takes the format with the fewest errors, of nearly equal formats that with the longest
/// bit. Without a given baud rate, it then measures the bit time from the start bit to the last change of the
/// characters, and returns nothing if there are too few changes, no bit time of 2.5 ticks or more, or more than one
/// error for two characters. `ticks_per_second` is needed only when the baud rate is given.
std::optional<AsyncFormat> find_format(const Changes& changes, Tick first, Tick end, const AsyncSettings& settings,
                                       std::uint64_t ticks_per_second);

}  // namespace absenc::capture
