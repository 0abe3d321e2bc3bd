// SPDX-License-Identifier: Apache-2.0
// The two CRCs of ESL. The document prints the polynomials in Koopman notation: 16'hAC9A is normal 5935, 8'h97 is 2F.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "absenc/core/bytes.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/protocol/esl/profile.hpp"

namespace absenc::esl {

enum class Channel : std::uint8_t { one, two };

inline constexpr CrcParameters crc16_lsb{16, 0x5935, 0, true, true, 0};
inline constexpr CrcParameters crc16_msb{16, 0x5935, 0, false, false, 0};
inline constexpr CrcParameters crc8_lsb{8, 0x2F, 0, true, true, 0};
inline constexpr CrcParameters crc8_msb{8, 0x2F, 0, false, false, 0};

[[nodiscard]] constexpr std::uint16_t initial_value(Channel channel) { return channel == Channel::two ? 0xFFFF : 0; }

/// What each nibble of up to eight bytes does to the remainder behind them, each alone: all look-ups of a channel are
/// independent of each other. 512 bytes; firmware takes 32 bytes and the look-ups one after the other.
inline constexpr bool small_table = __STDC_HOSTED__ == 0;

namespace detail {

using NibbleEffects = std::array<std::array<std::uint16_t, 16>, 16>;
inline constexpr NibbleEffects nibble_effects = [] {
  NibbleEffects table{};
  for (std::uint8_t nibble = 0; nibble < 16; ++nibble) {
    // As the upper half of a byte: the lower half comes first.
    const std::uint8_t byte = static_cast<std::uint8_t>(nibble << 4);
    std::array<std::uint8_t, 8> bytes{};
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes = {};
      bytes[i] = byte;
      table[2 * i + 1][nibble] = crc_bitwise(crc16_lsb, bytes);
      bytes[i] = nibble;
      table[2 * i][nibble] = crc_bitwise(crc16_lsb, bytes);
    }
  }
  return table;
}();
static_assert(sizeof(nibble_effects) == 512);

template <std::size_t... i>
constexpr std::uint64_t load(const std::uint8_t* bytes, std::index_sequence<i...>) {
  return ((std::uint64_t{bytes[i]} << (8 * i)) | ...);
}

template <std::size_t behind, std::size_t... byte>
constexpr std::uint16_t look_up(std::uint64_t word, std::index_sequence<byte...>) {
  constexpr std::size_t first = 16 - 2 * sizeof...(byte) - 2 * behind;
  const std::uint64_t lower = word & 0x0F0F0F0F0F0F0F0F;
  const std::uint64_t upper = word >> 4 & 0x0F0F0F0F0F0F0F0F;
  const std::uint32_t sum =
      ((std::uint32_t{nibble_effects[first + 2 * byte][static_cast<std::uint8_t>(lower >> (8 * byte))]} ^
        nibble_effects[first + 2 * byte + 1][static_cast<std::uint8_t>(upper >> (8 * byte))]) ^
       ...);
  return static_cast<std::uint16_t>(sum);
}

// The remainder behind `size` bytes and `behind` bytes of 00, 2 to 8 in all.
template <std::size_t size, std::size_t behind = 0>
constexpr std::uint16_t advance(std::uint16_t remainder, const std::uint8_t* bytes) {
  const std::uint64_t word = load(bytes, std::make_index_sequence<size>()) ^ remainder;
  return look_up<behind>(word, std::make_index_sequence<size>());
}

// Only channels of 9, 7, 5 and 4 bytes exist; where their number is odd, one 00 byte is appended.
constexpr std::uint16_t crc16_fast(std::uint16_t remainder, Bytes bytes) {
  const std::uint8_t* at = bytes.data();
  switch (bytes.size()) {
    case 9:
      return advance<7, 1>(advance<2>(remainder, at), at + 2);
    case 7:
      return advance<7, 1>(remainder, at);
    case 5:
      return advance<5, 1>(remainder, at);
    default:
      break;
  }
  for (; bytes.size() > 1; bytes = bytes.subspan(2)) remainder = advance<2>(remainder, bytes.data());
  if (bytes.size() == 1) remainder = advance<2>(remainder, std::array<std::uint8_t, 2>{bytes[0], 0}.data());
  return remainder;
}

// One 00 byte is appended where the number of bytes is odd.
constexpr std::uint16_t crc16_other(CrcBitOrder order, Channel channel, Bytes bytes) {
  Crc<crc16_msb, CrcTable::nibble> crc(initial_value(channel));
  if (order == CrcBitOrder::msb) {
    crc.update(bytes);
    if (bytes.size() % 2 != 0) crc.update(0);
    return crc.value();
  }
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    crc.update(i + 1 < bytes.size() ? bytes[i + 1] : std::uint8_t{0});
    crc.update(bytes[i]);
  }
  return crc.value();
}

}  // namespace detail

[[nodiscard]] constexpr std::uint16_t checksum16(CrcBitOrder order, Channel channel, Bytes bytes) {
  if (order != CrcBitOrder::lsb) return detail::crc16_other(order, channel, bytes);
  if constexpr (small_table) {
    Crc<crc16_lsb, CrcTable::nibble> crc(initial_value(channel));
    crc.update(bytes);
    if (bytes.size() % 2 != 0) crc.update(0);
    return crc.value();
  } else {
    return detail::crc16_fast(initial_value(channel), bytes);
  }
}

[[nodiscard]] constexpr std::uint8_t checksum8(CrcBitOrder order, Bytes bytes) {
  return order == CrcBitOrder::lsb ? Crc<crc8_lsb, CrcTable::nibble>::of(bytes)
                                   : Crc<crc8_msb, CrcTable::nibble>::of(bytes);
}

/// Whether the first of the two CRC bytes of this channel is the low one.
[[nodiscard]] constexpr bool low_byte_first(CrcByteOrder order, Channel channel) {
  if (order == CrcByteOrder::table12) return channel == Channel::one;
  return order == CrcByteOrder::low;
}

}  // namespace absenc::esl
