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
  Idle idle = Idle::automatic;  // idle level; `low` means an inverted line
  Tick glitch = 0;              // level changes closer together than this, in ticks, are removed as noise; 0: no filter
  unsigned data_bits = 8;       // number of data bits of a character, 5 to 16
};

/// Finds bit time and idle level, as far as `settings` leave them open, from the changes between `first` and `end`.
/// Returns nothing if the baud rate is not given and none fits. `ticks_per_second` is needed only with a given baud
/// rate.
std::optional<AsyncFormat> find_format(const Changes& changes, Tick first, Tick end, const AsyncSettings& settings,
                                       std::uint64_t ticks_per_second);

}  // namespace absenc::capture
