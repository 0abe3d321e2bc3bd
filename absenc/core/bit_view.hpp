// SPDX-License-Identifier: Apache-2.0
// Bit sequences as clocked links carry them: packed MSB first, the last byte left-aligned.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/crc.hpp"

namespace absenc {

/// A sequence of bits in bytes, the highest bit of each byte first.
struct BitView {
  Bytes bytes{};         ///< bits, packed with the first bit highest; the last byte is left-aligned
  std::size_t size = 0;  ///< number of bits in the view, at most eight for each byte

  /// Returns the bit at `index`, which is less than `size`.
  [[nodiscard]] constexpr bool operator[](std::size_t index) const {
    return ((bytes[index / 8] >> (7 - index % 8)) & 1) != 0;
  }

  /// Returns `count` (0 to 64) bits from index `first` on, the first as the highest. All must lie within the view.
  [[nodiscard]] constexpr std::uint64_t load(std::size_t first, unsigned count) const {
    if (count == 0) return 0;
    std::uint64_t value = 0;
    for (; count > window_bits; first += window_bits, count -= window_bits) {
      value = value << window_bits | window(first) >> (register_bits - window_bits);
    }
    return value << count | window(first) >> (register_bits - count);
  }

  /// Returns the same as `load`, but must be called only for 1 to 64 bits.
  [[nodiscard, gnu::always_inline]] constexpr std::uint64_t load_quickly(std::size_t first, unsigned count) const {
    if constexpr (register_bits < 64) return load(first, count);
    const std::uint64_t begin = window(first);
    if (count <= window_bits) return begin >> (64 - count);
    return begin >> 32 << (count - 32) | std::uint64_t{window(first + 32)} >> (96 - count);
  }

  /// Returns the index behind the run of equal bits from index `first` on, at most `size`.
  [[nodiscard]] constexpr std::size_t end_of_run(std::size_t first) const {
    const std::size_t ones = first < size && (*this)[first] ? 0 : ~std::size_t{0};
    for (std::size_t at = first; at < size; at += window_bits) {
      const auto run = static_cast<unsigned>(std::countl_one(window(at) ^ ones));
      if (run < window_bits) return std::min(at + run, size);
    }
    return size;
  }

  static constexpr unsigned register_bits = sizeof(std::size_t) * 8;  ///< Number of bits of a machine word.
  static constexpr unsigned window_bits = register_bits - 7;          ///< Number of bits that `window` always delivers.

  /// Returns a word whose top `window_bits` bits are the view's from `first` on; 0 behind the last byte. `first` must
  /// lie within `bytes`.
  [[nodiscard, gnu::always_inline]] constexpr std::size_t window(std::size_t first) const {
    if (bytes.size() < sizeof(std::size_t)) return short_window(bytes.data(), bytes.size(), first);
    const std::size_t at = std::min(first / 8, bytes.size() - sizeof(std::size_t));
    // when clang 14 evaluates `window` at compile time, it has not instantiated `register_at` yet
    if (std::is_constant_evaluated()) {
      std::size_t value = 0;
      for (std::size_t i = 0; i < sizeof(std::size_t); ++i) value = value << 8 | bytes[at + i];
      return value << (first - 8 * at);
    }
    return register_at(at, std::make_index_sequence<sizeof(std::size_t)>{}) << (first - 8 * at);
  }

 private:
  // Returns the machine word that begins at the byte `at`. There is no loop, so that the compiler can emit a single
  // load.
  template <std::size_t... i>
  [[nodiscard]] constexpr std::size_t register_at(std::size_t at, std::index_sequence<i...>) const {
    const std::uint8_t* from = bytes.data() + at;
    return ((std::size_t{from[i]} << (register_bits - 8 - 8 * i)) | ...);
  }
  // Does the work of `window` for a view shorter than a machine word. It does not take the view itself as an argument:
  // its address would force the view into memory.
  [[nodiscard, gnu::noinline]] static constexpr std::size_t short_window(const std::uint8_t* bytes, std::size_t count,
                                                                         std::size_t first) {
    std::size_t value = 0;
    unsigned shift = register_bits;
    for (std::size_t i = 0; i < count; ++i) value |= std::size_t{bytes[i]} << (shift -= 8);
    return value << first;
  }
};

/// A bit sequence of 1 to 64 bits in one number, the first bit as the highest.
struct BitNumber {
  std::uint64_t number;  ///< The bits as a number, the first bit highest.
  unsigned size;         ///< number of bits in `number`, 1 to 64

  /// Returns `count` bits from index `first` as a number; index 0 is bit `size` - 1 of `number`.
  [[nodiscard]] constexpr std::uint64_t load(std::size_t first, unsigned count) const {
    return count == 0 ? 0 : number >> (size - first - count) & low_mask(count);
  }
};

/// A buffer for up to `Capacity` bits.
template <std::size_t Capacity>
class BitBuffer {
 public:
  /// Appends the low `count` (0 to 64) bits of `value`, highest first. Returns false, and stores nothing, if they do
  /// not fit.
  constexpr bool append(std::uint64_t value, unsigned count) {
    if (count > Capacity - size_) return false;
    for (unsigned i = count; i-- > 0;) {
      const auto bit = static_cast<std::uint8_t>(0x80u >> size_ % 8);
      if (((value >> i) & 1) != 0) bytes_[size_ / 8] |= bit;
      ++size_;
    }
    return true;
  }
  /// Removes all bits from the buffer.
  constexpr void clear() { *this = {}; }

  /// Returns the number of stored bits.
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  /// Returns the greatest number of bits that the buffer can store.
  [[nodiscard]] static constexpr std::size_t capacity() { return Capacity; }
  /// Returns the bytes that hold the stored bits; unused bits of the last byte are 0.
  [[nodiscard]] constexpr Bytes bytes() const { return Bytes(bytes_).first((size_ + 7) / 8); }
  /// Returns a view of the stored bits; valid while this buffer is unchanged.
  [[nodiscard]] constexpr BitView view() const { return {bytes_, size_}; }

 private:
  std::array<std::uint8_t, (Capacity + 7) / 8> bytes_{};  // packed bits; all bits behind the first `size_` are 0
  std::size_t size_ = 0;
};

/// Returns the CRC of `count` bits of `bits` from index `first` on.
template <CrcParameters parameters, CrcTable table = CrcTable::byte, class Bits>
[[nodiscard]] constexpr auto crc_of(const Bits& bits, std::size_t first, std::size_t count) {
  static_assert(parameters.init == 0 && !parameters.refin);
  Crc<parameters, table> crc;
  const auto odd = static_cast<unsigned>(count % 8);
  if (odd != 0) crc.update(static_cast<std::uint8_t>(bits.load(first, odd)));
  for (std::size_t i = first + odd; i < first + count; i += 8) crc.update(static_cast<std::uint8_t>(bits.load(i, 8)));
  return crc.value();
}

}  // namespace absenc
