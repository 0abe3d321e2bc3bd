// SPDX-License-Identifier: Apache-2.0
// What a line is set to, and the extra wires beside the data: common to every kind of link.
#pragma once

#include <cstdint>

#include "absenc/core/time.hpp"

namespace absenc {

/// How items travel. The kind decides what `Step::Kind::transfer` means (link/step.hpp).
enum class LinkKind : std::uint8_t {
  half_duplex,  // one pair for both directions (RS-485): never send while the other side does
  full_duplex,  // a pair for each direction (RS-422, RS-232, USB serial)
  spi,          // every byte out brings one byte in
  clocked,      // the host clocks bits out of the encoder (SSI, BiSS); packed MSB first, the last byte left-aligned;
                // the clock idles high, its rising edge brings the next bit
  can,
};

enum class Parity : std::uint8_t { none, odd, even };

/// Wires beside the data, each driven by the host.
enum class ExtraWire : std::uint8_t { trigger, clear };

/// The rate of virtual encoders whose protocol leaves it open.
inline constexpr std::uint32_t assumed_rate = 115'200;

/// Of spi and clocked links the unit says here how a controller is set up; sim draws its waveforms by the same.
struct LineSettings {
  std::uint32_t rate = 0;  // bits a second: baud, SPI or shift clock, CAN bit rate
  Parity parity = Parity::none;
  std::uint8_t stop_bits = 1;
  std::uint8_t spi_mode = 0;       // spi, clocked: 2 * CPOL + CPHA
  std::uint8_t idle_clocks = 0;    // clocked: clocks that show the idle line before the first bit
  Time select_lead{};              // spi: from chip select to the first clock, at least
  std::uint32_t highest_rate = 0;  // that the document allows, where a controller could be faster; 0: not told

  /// The same; with `assumed_rate` where there is none.
  [[nodiscard]] constexpr LineSettings with_some_rate() const {
    LineSettings settings = *this;
    if (rate == 0) settings.rate = assumed_rate;
    return settings;
  }

  friend constexpr bool operator==(const LineSettings&, const LineSettings&) = default;

  /// `count` bits, rounded to the nearest nanosecond. `rate` must not be 0.
  [[nodiscard]] constexpr Time bits(std::uint64_t count) const {
    return Time((count * 1'000'000'000 + rate / 2) / rate);
  }
  /// Bits of one asynchronous character: start, 8 data, parity, stop.
  [[nodiscard]] constexpr unsigned character_bits() const {
    return 9u + (parity == Parity::none ? 0u : 1u) + stop_bits;
  }
  [[nodiscard]] constexpr Time character() const { return bits(character_bits()); }
};

}  // namespace absenc
