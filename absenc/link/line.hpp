// SPDX-License-Identifier: Apache-2.0
// Settings of a line of any kind, and the extra wires beside the data.
#pragma once

#include <cstdint>

#include "absenc/core/time.hpp"

namespace absenc {

/// Kinds of links: how items (bytes, bits or frames) travel.
enum class LinkKind : std::uint8_t {
  half_duplex,  ///< one pair of wires for both directions (RS-485): never send while the other side sends
  full_duplex,  ///< a pair of wires for each direction (RS-422, RS-232, USB serial)
  spi,          ///< SPI: the host's clock moves one byte in each direction at the same time
  /// The host clocks bits out of the encoder (SSI, BiSS), packed MSB first, the last byte left-aligned.
  clocked,
  /// As clocked, but the direction of the data line turns: the host sends bits first, then the encoder (EnDat).
  clocked_bidirectional,
  can,
};

/// Returns whether frames on links of this kind are sequences of bits, which need not fill whole bytes.
[[nodiscard]] constexpr bool carries_bits(LinkKind kind) {
  return kind == LinkKind::clocked || kind == LinkKind::clocked_bidirectional;
}
/// Returns whether the host clocks every item, so that the encoder sends only while the host clocks.
[[nodiscard]] constexpr bool host_clocks(LinkKind kind) { return kind == LinkKind::spi || carries_bits(kind); }

/// Parity of a character.
enum class Parity : std::uint8_t { none, odd, even };

/// Wires beside the data wires; the host drives them.
enum class ExtraWire : std::uint8_t { trigger, clear };

/// Bit rate, in bits per second, that is assumed where a protocol defines none.
inline constexpr std::uint32_t assumed_rate = 115'200;

/// Settings of a line.
struct LineSettings {
  std::uint32_t rate = 0;        ///< bits per second: baud rate, SPI or shift clock, CAN bit rate; 0: not set
  Parity parity = Parity::none;  ///< Parity of each character.
  std::uint8_t stop_bits = 1;    ///< Number of stop bits, 1 or 2.
  /// Data bits of each character, 5 to 16, the lowest first. More than 8 bits carry two bytes, the low one first.
  std::uint8_t data_bits = 8;
  std::uint8_t spi_mode = 0;     ///< SPI and clocked links: clock mode, 2 * CPOL + CPHA
  std::uint8_t idle_clocks = 0;  ///< clocked: number of clocks before the first bit, during which the line stays idle
  Time select_lead{};            ///< SPI: minimum time from chip select to the first clock
  Time delay{};                  ///< bidirectional clocked: delay of line and transceivers, there and back
  /// Highest rate in bits per second that the encoder's document allows; 0: not stated.
  std::uint32_t highest_rate = 0;

  /// Returns these settings, with `assumed_rate` if `rate` is 0.
  [[nodiscard]] constexpr LineSettings with_some_rate() const {
    LineSettings settings = *this;
    if (rate == 0) settings.rate = assumed_rate;
    return settings;
  }

  /// Returns whether all members of two settings are equal.
  friend constexpr bool operator==(const LineSettings&, const LineSettings&) = default;

  /// Returns the duration of `count` bits, rounded to the nearest nanosecond. `rate` must not be 0.
  [[nodiscard]] constexpr Time bits(std::uint64_t count) const {
    return Time((count * 1'000'000'000 + rate / 2) / rate);
  }
  /// Returns the number of bits of one asynchronous character: start, data, parity, stop.
  [[nodiscard]] constexpr unsigned character_bits() const {
    return 1u + data_bits + (parity == Parity::none ? 0u : 1u) + stop_bits;
  }
  /// Returns the number of bytes that one character carries, 1 or 2.
  [[nodiscard]] constexpr unsigned character_bytes() const { return data_bits > 8 ? 2 : 1; }
  /// Returns the duration of one asynchronous character.
  [[nodiscard]] constexpr Time character() const { return bits(character_bits()); }
  /// Returns the duration of a character divided by its number of bytes.
  [[nodiscard]] constexpr Time byte_time() const { return character() / character_bytes(); }
};

}  // namespace absenc
