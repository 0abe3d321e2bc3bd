// SPDX-License-Identifier: Apache-2.0
// Cyclic redundancy check of up to 64 bits in one number, with parameters known at run time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bits.hpp"
#include "absenc/core/crc.hpp"

namespace absenc {

/// The CRC of up to `4 * rows` bits in one number. `Entry` may be std::uint8_t for widths up to 8.
template <class Entry = std::uint16_t, std::size_t rows = 16>
class BitCrc {
 public:
  constexpr BitCrc() = default;
  /// Makes the table of a CRC over `count` bits, at most `4 * rows`. refin and refout must be false.
  constexpr BitCrc(const CrcParameters& parameters, unsigned count) : used_((count + 3) / 4) {
    const auto mask = static_cast<std::uint32_t>(low_mask(parameters.width));
    const auto step = [&](std::uint32_t remainder, bool bit) {
      const bool feedback = (remainder >> (parameters.width - 1) & 1) != (bit ? 1u : 0u);
      return ((remainder << 1) & mask) ^ (feedback ? parameters.poly & mask : 0);
    };
    if (parameters.width == 0) return;
    // remainder, by the polynomial of the CRC, of a single 1 at the present bit position
    std::uint32_t one = step(0, true);
    for (std::size_t row = 0; row < used_; ++row) {
      for (unsigned bit = 1; bit < 16; bit *= 2, one = step(one, false)) {
        for (unsigned i = 0; i < bit; ++i) table_[row][bit + i] = static_cast<Entry>(table_[row][i] ^ one);
      }
    }
    std::uint32_t zeros = parameters.init & mask;
    for (unsigned i = 0; i < count; ++i) zeros = step(zeros, false);
    of_zeros_ = static_cast<Entry>((zeros ^ parameters.xorout) & mask);
  }

  /// Returns the CRC of the `count` low bits of `bits`, the highest first. Higher bits must be 0.
  [[nodiscard]] constexpr std::uint16_t operator()(std::uint64_t bits) const {
    Entry remainder = of_zeros_;
    for (std::size_t row = 0; row < used_; ++row, bits >>= 4) remainder ^= table_[row][bits & 0xF];
    return remainder;
  }

 private:
  std::array<std::array<Entry, 16>, rows> table_{};
  std::size_t used_ = 0;
  Entry of_zeros_ = 0;
};

}  // namespace absenc
