// SPDX-License-Identifier: Apache-2.0
// BiSS-C frames (unidirectional) as samples of SLO, one for each clock of MA: encode, decode, every check a frame
// allows, and its times. README.md draws the frame. Sources: RLS "E201-9S Decoding the BiSS information"; BiSS Safety.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/core/result.hpp"
#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/word.hpp"

namespace absenc::biss {

using namespace std::chrono_literals;

/// x^6 + x + 1 over position and both status bits, sent inverted.
inline constexpr CrcParameters crc6_parameters{6, 0x03, 0, false, false, 0x3F};
/// 0x190D9 over position, status and life counter, sent inverted (BiSS Safety, safety position word).
inline constexpr CrcParameters crc16_parameters{16, 0x90D9, 0, false, false, 0xFFFF};

enum class Check : std::uint8_t { crc6, crc16 };

inline constexpr unsigned life_counter_bits = 6;  // before a CRC-16; counts 0 to 63 and goes on at 0
inline constexpr unsigned idle_bits = 2;          // SLO goes low on the second rising edge of MA

inline constexpr LineSettings line_settings{.rate = 1'000'000, .spi_mode = 3};
inline constexpr Time shortest_period = 100ns;  // of MA: 10 MHz
inline constexpr Time timeout_maximum = 40us;   // SLO stays low for 12.5 to 40 us after the last clock

struct Format {
  WordFormat word = "position:19 error:1! warning:1!"_word;
  Check check = Check::crc6;
  Scale scale{};
  std::uint32_t ma_khz = 1000;  // 10 to 10 000
  Time latency = 10us;          // the longest that the encoder needs, up to 1 ms: makes the number of clocks
  // Of the virtual encoder.
  Time ready{};  // what it needs itself; 0: as `latency`, but at most 10 us
  Time line_delay{};

  /// Of MA.
  [[nodiscard]] constexpr Time period() const { return Time((1'000'000 + ma_khz / 2) / ma_khz); }
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

/// ACK bits of an encoder that needs `latency` from the second rising edge of MA until its position is ready. Both up
/// to a second: a small processor divides 32 bits.
[[nodiscard]] constexpr unsigned ack_bits(Time latency, Time period) {
  const auto needed = static_cast<std::uint32_t>(latency.count());
  const auto clock = static_cast<std::uint32_t>(period.count());
  return std::max(1u, static_cast<unsigned>((needed + clock - 1) / clock));
}

/// Clocks that a whole frame needs.
[[nodiscard]] constexpr unsigned clocks(const Format& format, Time latency, Time period) {
  return idle_bits + ack_bits(latency, period) + 2 + data_bits(format);
}

template <class WordType>
struct ReplyWith {
  unsigned ack_bits = 1;
  WordType word{};
  std::uint8_t life_counter = 0;  // CRC-16 only
  std::uint16_t crc = 0;          // as sent
};
using Reply = ReplyWith<Word>;

namespace detail {

// What follows the CDS bit, in `bits` from `first` on.
template <class Source, class Bits, class ReplyType>
constexpr Error take_data(const Source& source, const Bits& bits, std::size_t first, ReplyType& reply) {
  const unsigned word = source.word.bits();
  std::uint16_t right = 0;
  if (source.format.check == Check::crc6) {
    reply.crc = static_cast<std::uint16_t>(bits.load(first + word, 6));
    right = crc_of<crc6_parameters>(bits, first, word);
  } else {
    const unsigned checked = word + life_counter_bits;
    reply.life_counter = static_cast<std::uint8_t>(bits.load(first + word, life_counter_bits));
    reply.crc = static_cast<std::uint16_t>(bits.load(first + checked, 16));
    right = crc_of<crc16_parameters, CrcTable::nibble>(bits, first, checked);
  }
  return reply.crc == right ? absenc::detail::take_word(source, bits, first, reply.word) : Error::bad_checksum;
}

template <class Source, class ReplyType>
constexpr Error take_frame(const Source& source, BitView samples, ReplyType& reply) {
  if (samples.size == 0) return Error::wrong_length;
  const std::size_t idle = samples[0] ? samples.end_of_run(0) : 0;
  if (idle == samples.size) return Error::line_stuck;
  const std::size_t start = samples.end_of_run(idle);
  if (start == samples.size) return idle == 0 ? Error::line_stuck : Error::bad_framing;  // no start bit
  const std::size_t first = start + 2;
  if (first > samples.size) return Error::truncated;
  if (samples[first - 1]) return Error::bad_framing;  // CDS
  const unsigned size = data_bits(source.format);
  if (size > samples.size - first) return Error::truncated;
  reply.ack_bits = static_cast<unsigned>(start - idle);
  if constexpr (!Source::is_known) {
    return take_data(source, absenc::detail::SomeBits(samples, first, size), 0, reply);
  } else {
    if (size > 64) return take_data(source, samples, first, reply);
    return take_data(source, BitNumber{samples.load(first, size), size}, 0, reply);
  }
}

template <class Source>
constexpr auto decode_by(const Source& source, BitView samples) {
  Result result = ReplyWith<typename Source::Word>{};
  const Error error = take_frame(source, samples, *result);
  if (error != Error::none) result = error;
  return result;
}

}  // namespace detail

/// The frame in samples of any length that begin while SLO is idle (1) or in the ACK (0). What follows the CRC is
/// ignored. Errors: wrong_length (no samples), line_stuck (all alike), bad_framing (no start bit, or CDS is 1),
/// truncated (the frame goes on behind the samples), bad_checksum (CRC, or the parity of the word).
[[nodiscard]] constexpr Result<Reply> decode(const Format& format, BitView samples) {
  return detail::decode_by(Given<Format>{format, format.word}, samples);
}

/// The same of a format that is known when the program is written, at the cost of what a hand would write for it. The
/// word has `values` only where the format has some.
template <const Format& format>
[[nodiscard]] constexpr Result<ReplyWith<typename Known<format>::Word>> decode(BitView samples) {
  return detail::decode_by(Known<format>{}, samples);
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
