// SPDX-License-Identifier: Apache-2.0
// What stands behind a BiSS word: its life counter and its CRC, as the maker chose them. Source: BiSS C Protocol
// Description rev D2; application note 21 (start value: that of the register in normal notation).
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/crc.hpp"

namespace absenc::biss {

inline constexpr unsigned life_counter_bits = 6;  // before the CRC and under it; counts 0 to 63 and goes on at 0

/// The default is that of nearly all encoders: x^6 + x + 1, inverted.
struct Check {
  std::uint8_t width = 6;     // bits, 0 to 16; 0: there is none
  std::uint16_t poly = 0x03;  // without its highest power
  std::uint16_t init = 0;
  bool inverted = true;
  bool life_counter = false;

  /// Behind the word.
  [[nodiscard]] constexpr unsigned bits() const { return width + (life_counter ? life_counter_bits : 0); }
  friend constexpr bool operator==(const Check&, const Check&) = default;
};

/// A polynomial ends in 1, or it is none.
[[nodiscard]] constexpr bool is_usable(const Check& check) { return check.width == 0 || (check.poly & 1) != 0; }

inline constexpr Check crc6{};
/// 0x190D9 with a life counter: that of the safety position word.
inline constexpr Check crc16{16, 0x90D9, 0, true, true};

[[nodiscard]] constexpr CrcParameters parameters_of(const Check& check) {
  const auto mask = static_cast<std::uint16_t>(low_mask(check.width));
  return {check.width, check.poly, check.init, false, false, check.inverted ? mask : std::uint16_t{0}};
}

namespace detail {

/// Of any parameters, one bit after the other.
template <class Bits>
[[nodiscard]] constexpr std::uint16_t crc_bit_by_bit(const Check& check, const Bits& bits, std::size_t first,
                                                     std::size_t count) {
  const auto mask = static_cast<std::uint32_t>(low_mask(check.width));
  const std::uint32_t top = (mask >> 1) + 1;
  std::uint32_t remainder = check.init & mask;
  for (const std::size_t end = first + count; first < end;) {
    const auto taken = static_cast<unsigned>(end - first < 32 ? end - first : 32);
    auto data = static_cast<std::uint32_t>(bits.load(first, taken) << (32 - taken));
    first += taken;
    for (unsigned i = 0; i < taken; ++i, data <<= 1) {
      const bool feedback = ((remainder & top) != 0) != ((data >> 31) != 0);
      remainder = ((remainder << 1) & mask) ^ (feedback ? check.poly & mask : 0);
    }
  }
  return static_cast<std::uint16_t>(remainder ^ (check.inverted ? mask : 0));
}

/// As sent. `Source` as in word.hpp: a check that is known when the program is written costs what a hand would write.
template <class Source, class Bits>
[[nodiscard]] constexpr std::uint16_t crc_as_sent(const Source& source, const Bits& bits, std::size_t first,
                                                  std::size_t count) {
  if constexpr (Source::is_known) {
    constexpr Check check = Source::format.check;
    if constexpr (check.width >= 3 && check.init == 0) {
      return crc_of < parameters_of(check), check.width <= 8 ? CrcTable::byte : CrcTable::nibble > (bits, first, count);
    } else {
      return crc_bit_by_bit(check, bits, first, count);
    }
  } else {
    if (source.format.check.width == crc6.width && source.format.check.poly == crc6.poly &&
        source.format.check.init == 0 && source.format.check.inverted) {
      return crc_of<parameters_of(crc6)>(bits, first, count);
    }
    return crc_bit_by_bit(source.format.check, bits, first, count);
  }
}

}  // namespace detail

}  // namespace absenc::biss
