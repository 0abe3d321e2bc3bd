// SPDX-License-Identifier: Apache-2.0
// The two CRCs of ESL. The document prints the polynomials in Koopman notation: 16'hAC9A is normal 5935, 8'h97 is 2F.
#pragma once

#include <cstddef>
#include <cstdint>

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

namespace detail {

// One 00 byte is appended where the number of bytes is odd. `swapped`: the second byte of each two comes first.
template <CrcParameters parameters>
constexpr std::uint16_t crc_of_pairs(Channel channel, Bytes bytes, bool swapped) {
  Crc<parameters, CrcTable::nibble> crc(initial_value(channel));
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    const std::uint8_t second = i + 1 < bytes.size() ? bytes[i + 1] : std::uint8_t{0};
    crc.update(swapped ? second : bytes[i]);
    crc.update(swapped ? bytes[i] : second);
  }
  return crc.value();
}

}  // namespace detail

[[nodiscard]] constexpr std::uint16_t checksum16(CrcBitOrder order, Channel channel, Bytes bytes) {
  return order == CrcBitOrder::lsb ? detail::crc_of_pairs<crc16_lsb>(channel, bytes, false)
                                   : detail::crc_of_pairs<crc16_msb>(channel, bytes, order == CrcBitOrder::word);
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
