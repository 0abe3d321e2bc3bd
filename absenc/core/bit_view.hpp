// SPDX-License-Identifier: Apache-2.0
// Runs of bits as clocked links carry them: packed MSB first, the last byte left-aligned.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/crc.hpp"

namespace absenc {

struct BitView {
  Bytes bytes{};
  std::size_t size = 0;  // bits; `bytes` holds at least so many

  [[nodiscard]] constexpr bool operator[](std::size_t index) const {
    return ((bytes[index / 8] >> (7 - index % 8)) & 1) != 0;
  }

  /// `count` bits (0 to 64) from `first` on, the first one the most significant. All of them must be there.
  [[nodiscard]] constexpr std::uint64_t load(std::size_t first, unsigned count) const {
    std::uint64_t value = 0;
    while (count > 0) {
      const auto left = static_cast<unsigned>(8 - first % 8);
      const unsigned take = std::min(left, count);
      value = value << take | ((bytes[first / 8] >> (left - take)) & low_mask(take));
      first += take;
      count -= take;
    }
    return value;
  }

  /// Where the run of equal bits that begins at `first` ends; `size` when it does not.
  [[nodiscard]] constexpr std::size_t end_of_run(std::size_t first) const {
    std::size_t end = first + 1;
    while (end < size && (*this)[end] == (*this)[first]) ++end;
    return std::min(end, size);
  }
};

template <std::size_t Capacity>
class BitBuffer {
 public:
  /// False, and nothing stored, when they do not all fit. `count`: 0 to 64, the most significant bit first.
  constexpr bool append(std::uint64_t value, unsigned count) {
    if (count > Capacity - size_) return false;
    for (unsigned i = count; i-- > 0;) {
      const auto bit = static_cast<std::uint8_t>(0x80u >> size_ % 8);
      if (((value >> i) & 1) != 0) bytes_[size_ / 8] |= bit;
      ++size_;
    }
    return true;
  }
  constexpr void clear() { *this = {}; }

  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] static constexpr std::size_t capacity() { return Capacity; }
  [[nodiscard]] constexpr Bytes bytes() const { return Bytes(bytes_).first((size_ + 7) / 8); }
  [[nodiscard]] constexpr BitView view() const { return {bytes_, size_}; }

 private:
  std::array<std::uint8_t, (Capacity + 7) / 8> bytes_{};  // 0 behind the end
  std::size_t size_ = 0;
};

/// The CRC of `count` bits from `first` on. Where their number is no multiple of 8 zeros are put before them, which
/// change nothing as long as the remainder begins at 0.
template <CrcParameters parameters, CrcTable table = CrcTable::byte>
[[nodiscard]] constexpr auto crc_of(BitView bits, std::size_t first, std::size_t count) {
  static_assert(parameters.init == 0 && !parameters.refin);
  Crc<parameters, table> crc;
  const auto odd = static_cast<unsigned>(count % 8);
  if (odd != 0) crc.update(static_cast<std::uint8_t>(bits.load(first, odd)));
  for (std::size_t i = first + odd; i < first + count; i += 8) crc.update(static_cast<std::uint8_t>(bits.load(i, 8)));
  return crc.value();
}

}  // namespace absenc
