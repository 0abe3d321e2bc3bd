// SPDX-License-Identifier: Apache-2.0
// BiSS-C frames (unidirectional) as samples of SLO, one for each clock of MA: encode, decode and every check a frame
// allows. README.md draws the frame. Sources: RLS "E201-9S Decoding the BiSS information"; BiSS Safety.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/word.hpp"

namespace absenc::biss {

/// x^6 + x + 1 over position and both status bits, sent inverted.
inline constexpr CrcParameters crc6_parameters{6, 0x03, 0, false, false, 0x3F};
/// 0x190D9 over position, status and life counter, sent inverted (BiSS Safety, safety position word).
inline constexpr CrcParameters crc16_parameters{16, 0x90D9, 0, false, false, 0xFFFF};

enum class Check : std::uint8_t { crc6, crc16 };

inline constexpr unsigned life_counter_bits = 6;  // before a CRC-16; counts 0 to 63 and goes on at 0
inline constexpr unsigned idle_bits = 2;          // SLO goes low on the second rising edge of MA

struct Format {
  WordFormat word = "position:19 error:1! warning:1!"_word;
  Check check = Check::crc6;
  Scale scale{};
};

/// Turns and position, nError, nWarning.
[[nodiscard]] constexpr WordFormat word_with_status(const PositionBits& bits) {
  WordFormat word = word_format(bits);
  word.add({"error", Meaning::error, 1, true});
  word.add({"warning", Meaning::warning, 1, true});
  return word;
}

/// Word, life counter and CRC: what follows the CDS bit.
[[nodiscard]] constexpr unsigned data_bits(const Format& format) {
  return format.word.bits() + (format.check == Check::crc6 ? 6 : life_counter_bits + 16);
}

struct Reply {
  unsigned ack_bits = 1;
  Word word{};
  std::uint8_t life_counter = 0;  // CRC-16 only
  std::uint16_t crc = 0;          // as sent
};

/// Where the data of a checked frame begin in the samples.
struct Framing {
  std::size_t first;
  unsigned ack_bits;
  std::uint16_t crc;
};

namespace detail {

// One more bit of a remainder of 6.
constexpr std::uint32_t shifted(std::uint32_t remainder) {
  return (remainder << 1) ^ ((remainder & 0x20) != 0 ? 0x43u : 0);
}

// What each byte of a 64-bit number adds to its CRC-6: look-ups that do not wait for each other. 2 KB.
inline constexpr auto crc6_slices = [] {
  std::array<std::array<std::uint8_t, 256>, 8> slices{};
  for (std::uint32_t value = 0; value < 256; ++value) {
    std::uint32_t remainder = 0;
    for (unsigned bit = 8; bit-- > 0;) remainder = shifted(remainder) ^ ((value >> bit & 1) != 0 ? 0x03u : 0);
    for (auto& slice : slices) {
      slice[value] = static_cast<std::uint8_t>(remainder);
      for (unsigned i = 0; i < 8; ++i) remainder = shifted(remainder);
    }
  }
  return slices;
}();

}  // namespace detail

/// The inverted CRC-6 of a number of at most 64 bits.
[[nodiscard]] constexpr std::uint8_t crc6(std::uint64_t number) {
  std::uint32_t remainder = 0x3F;
  for (unsigned i = 0; i < 5; ++i) remainder ^= detail::crc6_slices[i][number >> (8 * i) & 0xFF];
  for (unsigned i = 5; i < 8 && number >> 40 != 0; ++i) remainder ^= detail::crc6_slices[i][number >> (8 * i) & 0xFF];
  return static_cast<std::uint8_t>(remainder);
}

/// A frame with CRC-6 in the top `size` (1 to 64) bits of `samples`, the first sample at the top; the rest is 0. The
/// errors are those of `decode`.
[[nodiscard]] constexpr Result<Framing> find_frame(unsigned data, std::uint64_t samples, unsigned size = 64) {
  const auto idle = static_cast<unsigned>(std::countl_one(samples));
  if (idle >= size || samples == 0) return Error::line_stuck;
  const std::uint64_t from_ack = samples << idle;
  if (from_ack == 0) return Error::bad_framing;  // no start bit
  const auto ack = static_cast<unsigned>(std::countl_zero(from_ack));
  const unsigned first = idle + ack + 2;
  if (first > size) return Error::truncated;
  if ((samples >> (64 - first) & 1) != 0) return Error::bad_framing;  // CDS
  if (data > size - first) return Error::truncated;
  const std::uint64_t frame = samples << first >> (64 - data);
  const auto crc = static_cast<std::uint8_t>(frame & 0x3F);
  if (crc6(frame >> 6) != crc) return Error::bad_checksum;
  return Framing{first, ack, crc};
}

/// The same for any number of samples and both checks, one bit after the other where that does.
[[nodiscard]] constexpr Result<Framing> find_frame(const Format& format, BitView samples) {
  if (samples.size == 0) return Error::wrong_length;
  const std::size_t idle = samples[0] ? samples.end_of_run(0) : 0;
  if (idle == samples.size) return Error::line_stuck;
  const std::size_t start = samples.end_of_run(idle);
  if (start == samples.size) return idle == 0 ? Error::line_stuck : Error::bad_framing;
  const std::size_t first = start + 2;
  if (first > samples.size) return Error::truncated;
  if (samples[first - 1]) return Error::bad_framing;  // CDS
  if (data_bits(format) > samples.size - first) return Error::truncated;
  const bool small = format.check == Check::crc6;
  const std::size_t checked = data_bits(format) - (small ? 6 : 16);
  const auto crc = static_cast<std::uint16_t>(samples.load(first + checked, small ? 6 : 16));
  const std::uint16_t right = small ? crc_of<crc6_parameters>(samples, first, checked)
                                    : crc_of<crc16_parameters, CrcTable::nibble>(samples, first, checked);
  if (crc != right) return Error::bad_checksum;
  return Framing{first, static_cast<unsigned>(start - idle), crc};
}

/// The frame in samples of any length that begin while SLO is idle (1) or in the ACK (0). What follows the CRC is
/// ignored. Errors: wrong_length (no samples), line_stuck (all alike), bad_framing (no start bit, or CDS is 1),
/// truncated (the frame goes on behind the samples), bad_checksum (CRC, or the parity of the word).
[[nodiscard]] constexpr Result<Reply> decode(const Format& format, BitView samples) {
  const bool fits = format.check == Check::crc6 && samples.size >= 1 && samples.size <= 64;
  const auto size = static_cast<unsigned>(fits ? samples.size : 64);
  const Result<Framing> framing =
      fits ? find_frame(data_bits(format), samples.load(0, size) << (64 - size), size) : find_frame(format, samples);
  if (!framing) return framing.error();
  const Result<Word> word = decode_word(format.word, samples, framing->first);
  if (!word) return word.error();
  Reply reply{.ack_bits = framing->ack_bits, .word = *word, .crc = framing->crc};
  if (format.check == Check::crc16) {
    const std::size_t at = framing->first + format.word.bits();
    reply.life_counter = static_cast<std::uint8_t>(samples.load(at, life_counter_bits));
  }
  return reply;
}

/// Appends idle bits, ACK, start, CDS, word and check; `reply.crc` is not used. False when `out` is too small.
template <std::size_t Capacity>
constexpr bool encode(const Format& format, const Reply& reply, BitBuffer<Capacity>& out) {
  if (out.capacity() - out.size() < idle_bits + reply.ack_bits + 2 + data_bits(format)) return false;
  out.append(low_mask(idle_bits), idle_bits);
  for (unsigned i = 0; i < reply.ack_bits; ++i) out.append(0, 1);
  out.append(0b10, 2);
  const std::size_t first = out.size();
  encode_word(format.word, reply.word, out);
  if (format.check == Check::crc6) {
    out.append(crc_of<crc6_parameters>(out.view(), first, out.size() - first), 6);
  } else {
    out.append(reply.life_counter, life_counter_bits);
    out.append(crc_of<crc16_parameters, CrcTable::nibble>(out.view(), first, out.size() - first), 16);
  }
  return true;
}

}  // namespace absenc::biss
