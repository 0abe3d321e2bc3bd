// SPDX-License-Identifier: Apache-2.0
// Cyclic redundancy checks of 3 to 16 bits, with the parameters of the Rocksoft model.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"

namespace absenc {

/// Parameters of a CRC. `poly` is in normal notation: x8+x5+x3+x2+x+1 is 0x2F.
struct CrcParameters {
  unsigned width;        ///< width of the checksum in bits: 3 to 16, but 0 to 16 for the class BitCrc
  std::uint16_t poly;    ///< Polynomial of the CRC without its highest term.
  std::uint16_t init;    ///< Value of the CRC register before the first byte.
  bool refin;            ///< Whether each byte is processed lowest bit first.
  bool refout;           ///< Whether the bits of the CRC register are reversed before `xorout` is applied.
  std::uint16_t xorout;  ///< Value that is combined with the register by exclusive OR to give the checksum.

  /// Returns whether two CRCs have the same parameters.
  friend constexpr bool operator==(const CrcParameters&, const CrcParameters&) = default;
};

/// Returns the CRC of `bytes`, computed bit by bit.
[[nodiscard]] constexpr std::uint16_t crc_bitwise(const CrcParameters& parameters, Bytes bytes) {
  const std::uint32_t top = std::uint32_t{1} << (parameters.width - 1);
  const auto mask = static_cast<std::uint32_t>(low_mask(parameters.width));
  std::uint32_t remainder = parameters.init & mask;
  for (const std::uint8_t byte : bytes) {
    for (unsigned i = 0; i < 8; ++i) {
      const unsigned position = parameters.refin ? i : 7 - i;
      const bool bit = ((byte >> position) & 1) != 0;
      const bool feedback = ((remainder & top) != 0) != bit;
      remainder = (remainder << 1) & mask;
      if (feedback) remainder ^= parameters.poly;
    }
  }
  if (parameters.refout) remainder = reflect(remainder, parameters.width);
  return static_cast<std::uint16_t>((remainder ^ parameters.xorout) & mask);
}

/// Sizes of the look-up table that the class `Crc` uses.
enum class CrcTable {
  byte,    ///< table of 256 entries, one look-up per byte: 256 bytes up to width 8, 512 above
  nibble,  ///< table of 16 entries, two look-ups per byte: 16 or 32 bytes, for firmware
};

/// The running calculation of a CRC with a table.
template <CrcParameters parameters, CrcTable table_kind = CrcTable::byte>
class Crc {
  static_assert(parameters.width >= 3 && parameters.width <= 16, "widths from 3 to 16 bits");

 public:
  /// Smallest type that holds a checksum.
  using Word = std::conditional_t<(parameters.width <= 8), std::uint8_t, std::uint16_t>;

  constexpr Crc() = default;
  /// Starts with the register value `init` instead of `parameters.init`.
  constexpr explicit Crc(std::uint16_t init) : remainder_(initial(init)) {}

  /// Adds a byte to the checksum.
  constexpr void update(std::uint8_t byte) {
    if constexpr (table_kind == CrcTable::byte) {
      step<8>(byte);
    } else if constexpr (parameters.refin) {
      step<4>(byte & 0xF);
      step<4>(byte >> 4);
    } else {
      step<4>(byte >> 4);
      step<4>(byte & 0xF);
    }
  }

  /// Adds bytes to the checksum in their order.
  constexpr void update(Bytes bytes) {
    for (const std::uint8_t byte : bytes) update(byte);
  }

  /// Returns the checksum of all bytes added so far.
  [[nodiscard]] constexpr Word value() const {
    std::uint32_t result = parameters.refin ? remainder_ : remainder_ >> spare_bits;
    if constexpr (parameters.refin != parameters.refout) {
      result = reflect(result, parameters.width);
    }
    return static_cast<Word>((result ^ parameters.xorout) & low_mask(parameters.width));
  }

  /// Returns the checksum of `bytes`.
  [[nodiscard]] static constexpr Word of(Bytes bytes) {
    Crc crc;
    crc.update(bytes);
    return crc.value();
  }

  /// Size of this CRC's look-up table in constant memory, in bytes.
  static constexpr std::size_t table_bytes = (std::size_t{1} << (table_kind == CrcTable::byte ? 8 : 4)) * sizeof(Word);

 private:
  static constexpr unsigned word_bits = sizeof(Word) * 8;
  static constexpr unsigned spare_bits = word_bits - parameters.width;

  // The polynomial, aligned like the remainder (reflected or left-aligned).
  static constexpr std::uint32_t poly =
      parameters.refin ? reflect(parameters.poly, parameters.width) : std::uint32_t{parameters.poly} << spare_bits;

  // Returns the remainder of `bits` bits of input: one entry of the table.
  static constexpr Word advance(std::uint32_t input, unsigned bits) {
    std::uint32_t remainder = 0;
    if constexpr (parameters.refin) {
      remainder = input;
      for (unsigned i = 0; i < bits; ++i) remainder = (remainder >> 1) ^ ((remainder & 1) != 0 ? poly : 0);
    } else {
      const std::uint32_t top = std::uint32_t{1} << (word_bits - 1);
      remainder = input << (word_bits - bits);
      for (unsigned i = 0; i < bits; ++i) {
        remainder = (remainder << 1) ^ ((remainder & top) != 0 ? poly : 0);
      }
    }
    return static_cast<Word>(remainder);
  }

  static constexpr unsigned input_bits = table_kind == CrcTable::byte ? 8 : 4;
  static constexpr auto table = [] {
    std::array<Word, std::size_t{1} << input_bits> entries{};
    for (std::uint32_t i = 0; i < entries.size(); ++i) entries[i] = advance(i, input_bits);
    return entries;
  }();
  static_assert(sizeof(table) == table_bytes);

  template <unsigned bits>
  constexpr void step(std::uint32_t input) {
    const std::uint32_t remainder = remainder_;
    if constexpr (parameters.refin) {
      const std::uint32_t index = (remainder ^ input) & low_mask(bits);
      remainder_ = static_cast<Word>((remainder >> bits) ^ table[index]);
    } else {
      const std::uint32_t index = ((remainder >> (word_bits - bits)) ^ input) & low_mask(bits);
      remainder_ = static_cast<Word>((remainder << bits) ^ table[index]);
    }
  }

  static constexpr Word initial(std::uint16_t init) {
    return parameters.refin ? static_cast<Word>(reflect(init, parameters.width))
                            : static_cast<Word>((init & low_mask(parameters.width)) << spare_bits);
  }
  Word remainder_ = initial(parameters.init);
};

}  // namespace absenc
