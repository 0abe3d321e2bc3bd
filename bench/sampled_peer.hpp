// SPDX-License-Identifier: Apache-2.0
// The method by which mjbots' moteus decodes BiSS frames, implemented here only for comparison.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace absenc::bench {

/// Configuration of moteus' decoder, with which the library's decoder is compared.
struct SampledPeer {
  unsigned pin;
  unsigned bits;  // number of bits of the encoder's position, up to 58
};

struct SampledPosition {
  enum class Error : std::uint8_t { none, no_start, truncated, checksum } error = Error::none;
  std::uint64_t position = 0;
  bool error_bit = false;
  bool warning_bit = false;
};

namespace detail {

// CRC remainders of six bits followed by six zeros, for the polynomial x^6 + x + 1.
inline constexpr auto six_bits = [] {
  std::array<std::uint8_t, 64> table{};
  for (unsigned value = 0; value < 64; ++value) {
    unsigned rest = value << 6;
    for (unsigned bit = 12; bit-- > 6;) rest ^= (rest >> bit & 1) != 0 ? 0x43u << (bit - 6) : 0;
    table[value] = static_cast<std::uint8_t>(rest);
  }
  return table;
}();

constexpr std::uint32_t every_byte = 0x0101'0101;

inline std::uint32_t four_samples(const std::uint8_t* samples, unsigned pin) {
  std::uint32_t four = 0;
  // the compiler turns this copy of four bytes into a single load instruction, also in a freestanding program
  __builtin_memcpy(&four, samples, sizeof four);
  return four >> pin & every_byte;
}

// Packs the lowest bits of four bytes into four bits; the bit of the first byte is the highest.
inline std::uint32_t gathered(std::uint32_t four) { return four * 0x0804'0201 >> 24; }

// Returns the CRC of the lower `bits` bits of `data`, in steps of six bits.
inline unsigned checksum(std::uint64_t data, unsigned bits) {
  unsigned rest = 0;
  const auto step = [&](unsigned shift) { rest = six_bits[(data >> shift & 0x3F) ^ rest]; };
  if (bits > 30) step(54), step(48), step(42), step(36), step(30);
  step(24), step(18), step(12), step(6), step(0);
  return rest;
}

template <class Register>
Register gather(const std::uint8_t* samples, unsigned bits, unsigned pin) {
  Register data = 0;
  for (; bits >= 4; bits -= 4, samples += 4) data = data << 4 | gathered(four_samples(samples, pin));
  for (; bits > 0; --bits, ++samples) data = data << 1 | (*samples >> pin & 1u);
  return data;
}

}  // namespace detail

/// Decodes the BiSS frame in `samples`, of which there are at least 28. The start bit must be among the first 25
/// samples.
inline SampledPosition take(const SampledPeer& peer, std::span<const std::uint8_t> samples) {
  using Error = SampledPosition::Error;
  constexpr std::size_t searched = 25;
  const auto level = [&](std::size_t at) { return samples[at] >> peer.pin & 1u; };
  std::size_t at = 0;
  while (at < searched && level(at) != 0) ++at;
  while (at % 4 != 0 && at < searched && level(at) == 0) ++at;
  if (at < searched && level(at) == 0) {
    std::uint32_t four = 0;
    while (at < searched && (four = detail::four_samples(&samples[at], peer.pin)) == 0) at += 4;
    at += static_cast<std::size_t>(std::countr_zero(four)) / 8;
  }
  if (at >= searched) return {Error::no_start};
  const std::size_t first = at + 2;
  const std::size_t behind = first + peer.bits;
  if (behind + 8 > samples.size()) return {Error::truncated};
  const std::uint64_t position = peer.bits <= 32 ? detail::gather<std::uint32_t>(&samples[first], peer.bits, peer.pin)
                                                 : detail::gather<std::uint64_t>(&samples[first], peer.bits, peer.pin);
  const std::uint64_t data = position << 2 | level(behind) << 1 | level(behind + 1);
  const std::uint32_t four = detail::gathered(detail::four_samples(&samples[behind + 2], peer.pin));
  const unsigned sent = (four << 2 | level(behind + 6) << 1 | level(behind + 7)) ^ 0x3F;
  if (sent != detail::checksum(data, peer.bits + 2)) return {Error::checksum};
  return {Error::none, position, level(behind) == 0, level(behind + 1) == 0};
}

}  // namespace absenc::bench
