// SPDX-License-Identifier: Apache-2.0
// Life counter and CRC after a BiSS word. Sources: BiSS C Protocol Description rev D2; application note 21.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/crc.hpp"

namespace absenc::biss {

/// Number of bits of the life counter, which the CRC covers.
inline constexpr unsigned life_counter_bits = 6;

/// Parameters of the CRC and the life counter after a word; the default is x^6 + x + 1, inverted.
struct Check {
  std::uint8_t width = 6;     ///< Number of bits of the CRC, 0 to 16; 0: no CRC.
  std::uint16_t poly = 0x03;  ///< Polynomial of the CRC without its highest power.
  std::uint16_t init = 0;     ///< Value of the CRC register before the first bit.
  bool inverted = true;       ///< Whether the CRC is sent inverted.
  bool life_counter = false;  ///< Whether a life counter precedes the CRC.

  /// Returns the number of bits after the word: life counter and CRC.
  [[nodiscard]] constexpr unsigned bits() const { return width + (life_counter ? life_counter_bits : 0); }
  /// Returns whether two checks have the same CRC parameters and the same life counter setting.
  friend constexpr bool operator==(const Check&, const Check&) = default;
};

/// Returns whether the polynomial ends in the term 1 or there is no CRC; a polynomial without this term makes a weaker
/// CRC.
[[nodiscard]] constexpr bool is_usable(const Check& check) { return check.width == 0 || (check.poly & 1) != 0; }

inline constexpr Check crc6{};  ///< Check of most encoders: a CRC of 6 bits.
/// Check of the safety position word: polynomial 0x190D9, with a life counter.
inline constexpr Check crc16{16, 0x90D9, 0, true, true};

/// Returns the parameters of the CRC of `check`, as the functions of crc.hpp take them.
[[nodiscard]] constexpr CrcParameters parameters_of(const Check& check) {
  const auto mask = static_cast<std::uint16_t>(low_mask(check.width));
  return {check.width, check.poly, check.init, false, false, check.inverted ? mask : std::uint16_t{0}};
}

namespace detail {

/// Computes the CRC of `check` over `count` bits from `first` on, bit by bit.
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

/// Returns the CRC of `count` bits from `first` on, as the encoder sends it. `Source`: Given or Known of word.hpp.
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
