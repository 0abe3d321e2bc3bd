// SPDX-License-Identifier: Apache-2.0
// Draws the waveform of a conversation with a virtual encoder, in virtual time.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/time.hpp"

namespace absenc::client {

/// Choices of `draw_wave`: which commands it draws, how often, and how the file is written.
struct WaveChoices {
  /// Commands with arguments, as "memory-read 5"; empty: the command that reads the position.
  std::vector<std::string> commands{};
  std::uint64_t count = 1;  ///< Number of results to draw, at least 1.
  double rate = 1000;       ///< Number of results per second; the waveform has fewer if the line is slower.
  /// Number of samples per second in .sr files, up to 1e9; 0: 16 samples per bit of the line.
  std::uint64_t samples_per_second = 0;
  bool replaces = false;  ///< Whether an existing file of this name may be replaced.
  /// Called with the present step of the work. An exception of it ends the drawing.
  std::function<void(const std::string& what)> progress{};
};

/// Result of `draw_wave`.
struct Waved {
  std::uint64_t results = 0;         ///< Number of results that were drawn, including failures.
  std::uint64_t failures = 0;        ///< Number of drawn results that are failures.
  Time time{};                       ///< Duration of the whole waveform, in virtual time.
  std::vector<std::string> wires{};  ///< Names of the wires that the file contains.
};

/// Draws a waveform into `file`, whose name ends in .vcd, .sr or .csv, and returns what was drawn. `text` is an address
/// with or without "sim:", as "tformat?motion=rpm=60"; `settings` are those of `open`. Throws UsageError, Failure,
/// os::Failure, std::runtime_error.
[[nodiscard]] Waved draw_wave(std::string_view text, std::span<const std::string> settings, const std::string& file,
                              const WaveChoices& choices = {});

}  // namespace absenc::client
