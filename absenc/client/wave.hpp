// SPDX-License-Identifier: Apache-2.0
// A conversation with a virtual encoder, in virtual time, as a waveform of its wires.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/time.hpp"

namespace absenc::client {

/// What `wave` draws, and how many times.
struct WaveChoices {
  std::vector<std::string> commands{};   ///< with arguments, as "memory-read 5", one after the other; none: reads
  std::uint64_t count = 1;               ///< results, at least 1
  double rate = 1000;                    ///< results a second; less where the line cannot
  std::uint64_t samples_per_second = 0;  ///< of .sr files, up to 1e9; 0: 16 for each bit of the line
  bool replaces = false;                 ///< the file may be there already
  /// Called now and then with what is done; what it throws ends it, and no file is left.
  std::function<void(const std::string& what)> progress{};
};

/// Result of `wave`.
struct Waved {
  std::uint64_t results = 0;         ///< Number of readings that were drawn.
  std::uint64_t failures = 0;        ///< of them
  Time time{};                       ///< of the whole waveform
  std::vector<std::string> wires{};  ///< Names of the wires in the file.
};

/// Writes `file`, whose name ends in .vcd, .sr (sigrok) or .csv (as Saleae Logic 2). `text`: "tformat?motion=rpm=60",
/// with or without "sim:" in front; `settings` as those of `open`. Throws UsageError, Failure, os::Failure.
[[nodiscard]] Waved draw_wave(std::string_view text, std::span<const std::string> settings, const std::string& file,
                              const WaveChoices& choices = {});

}  // namespace absenc::client
