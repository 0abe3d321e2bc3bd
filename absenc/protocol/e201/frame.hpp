// SPDX-License-Identifier: Apache-2.0
// RLS E201-9S USB interface: one-letter commands and the ASCII that answers them. README.md lists them and says where
// each comes from. What no document describes is read as leniently as possible.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/core/text.hpp"
#include "absenc/protocol/biss/frame.hpp"
#include "absenc/protocol/ssi/frame.hpp"

namespace absenc::e201 {

namespace command {
inline constexpr std::uint8_t samples = '4';
inline constexpr std::uint8_t version = 'v';
inline constexpr std::uint8_t serial = 's';
inline constexpr std::uint8_t supply = 'e';
inline constexpr std::uint8_t supply_on = 'n';
inline constexpr std::uint8_t supply_off = 'f';
inline constexpr std::uint8_t decimal = '?';
inline constexpr std::uint8_t hexadecimal = '>';
inline constexpr std::uint8_t zero = 'z';
inline constexpr std::uint8_t clear_zero = 'a';
inline constexpr std::uint8_t stream_off = '0';
inline constexpr std::uint8_t stream_on = '1';
inline constexpr std::uint8_t set_clock = 'M';
inline constexpr std::uint8_t clock = 'm';
inline constexpr std::uint8_t set_width = 'B';
inline constexpr std::uint8_t width = 'b';
inline constexpr std::string_view all = "4vsenf?>za01MmBb";
[[nodiscard]] constexpr bool is_known(std::uint8_t letter) {
  return index_of(all, static_cast<char>(letter)) < all.size();
}
}  // namespace command

/// What M1 to M8 make MA, kHz.
inline constexpr std::array<std::uint16_t, 8> clocks_khz{35, 70, 140, 280, 560, 1100, 2200, 4400};

inline constexpr char end_of_line = '\r';
inline constexpr std::size_t sample_bits = 64;
inline constexpr std::size_t samples_length = 17;  // 16 hexadecimal digits and CR
inline constexpr std::size_t request_capacity = 4;
inline constexpr std::size_t reply_capacity = 64;
using RequestText = ByteBuffer<request_capacity>;
using ReplyText = ByteBuffer<reply_capacity>;

/// What is behind the adapter.
enum class Carries : std::uint8_t { biss, ssi };

struct Format {
  Carries carries = Carries::biss;
  biss::Format biss{};
  ssi::Format ssi{};

  [[nodiscard]] constexpr const WordFormat& word() const { return carries == Carries::biss ? biss.word : ssi.word; }
  [[nodiscard]] constexpr const Scale& scale() const { return carries == Carries::biss ? biss.scale : ssi.scale; }
};

/// `value` for set_clock (1 to 8) and set_width (0 to 99).
[[nodiscard]] constexpr RequestText encode_request(std::uint8_t letter, unsigned value = 0) {
  RequestText text;
  text.push_back(letter);
  if (letter == command::set_width) text.push_back(static_cast<std::uint8_t>('0' + value / 10 % 10));
  if (letter != command::set_width && letter != command::set_clock) return text;
  text.push_back(static_cast<std::uint8_t>('0' + value % 10));
  text.push_back(end_of_line);
  return text;
}

[[nodiscard]] constexpr ReplyText encode_samples(std::uint64_t samples) {
  ReplyText text;
  for (unsigned i = 64; i > 0; i -= 4) {
    text.push_back(static_cast<std::uint8_t>("0123456789abcdef"[samples >> (i - 4) & 0xF]));
  }
  text.push_back(end_of_line);
  return text;
}

/// Errors: wrong_length (not 16 characters and CR), bad_framing (not hexadecimal).
[[nodiscard]] constexpr Result<std::uint64_t> decode_samples(Bytes reply) {
  if (reply.size() != samples_length || reply[samples_length - 1] != end_of_line) return Error::wrong_length;
  std::uint64_t samples = 0;
  for (const std::uint8_t c : reply.first(samples_length - 1)) {
    const int digit = hex_digit(static_cast<char>(c));
    if (digit < 0) return Error::bad_framing;
    samples = samples << 4 | static_cast<std::uint64_t>(digit);
  }
  return samples;
}

struct Position {
  unsigned ack_bits = 0;  // BiSS
  std::uint16_t crc = 0;  // BiSS
  std::uint8_t life_counter = 0;
  Word word{};
};

namespace detail {

[[nodiscard]] constexpr Result<Position> decode_biss(const Format& format, BitView samples) {
  if (samples.load(0, 3) != 0b110) return Error::bad_framing;  // SLO goes low on the second rising edge
  const Result<biss::Reply> reply = biss::decode(format.biss, samples);
  if (!reply) return reply.error();
  return Position{reply->ack_bits, reply->crc, reply->life_counter, reply->word};
}

// The first sample is before the first rising edge, which shifts out the MSB; the encoder is clocked on.
[[nodiscard]] constexpr Result<Position> decode_ssi(const Format& format, BitView samples) {
  if (!samples[0]) return Error::bad_framing;
  if (format.ssi.word.bits() > sample_bits - 1) return Error::truncated;
  const Result<Word> word = ssi::decode_clocked_on(format.ssi, samples, 1);
  if (!word) return word.error();
  return Position{.word = *word};
}

}  // namespace detail

/// The reply to `4`. Errors, besides those of decode_samples: line_stuck (all samples alike), bad_framing (not 110 at
/// the beginning, no start bit, CDS is 1), truncated (the frame goes on behind the samples), bad_checksum; of SSI those
/// of ssi::decode_clocked_on.
[[nodiscard]] constexpr Result<Position> decode_position(const Format& format, Bytes reply) {
  const Result<std::uint64_t> samples = decode_samples(reply);
  if (!samples) return samples.error();
  if (*samples == 0 || *samples == ~std::uint64_t{0}) return Error::line_stuck;
  std::array<std::uint8_t, 8> bytes{};
  store_big_endian(bytes, *samples);
  const BitView bits{bytes, sample_bits};
  return format.carries == Carries::biss ? detail::decode_biss(format, bits) : detail::decode_ssi(format, bits);
}

// ---- Texts that no document describes

/// Without the CR, spaces and LF around it.
[[nodiscard]] constexpr Bytes trimmed(Bytes text) {
  const auto blank = [](std::uint8_t c) { return c == ' ' || c == '\r' || c == '\n' || c == '\t'; };
  while (!text.empty() && blank(text.front())) text = text.subspan(1);
  while (!text.empty() && blank(text.back())) text = text.first(text.size() - 1);
  return text;
}

struct Version {
  unsigned major;
  unsigned minor;
};

/// `4` exists since then (E201-9S document).
[[nodiscard]] constexpr bool has_samples(Version version) {
  return version.major > 1 || (version.major == 1 && version.minor >= 16);
}

namespace detail {

constexpr bool is_digit(std::uint8_t c) { return c >= '0' && c <= '9'; }

// Digits from `at` on, at most 9 of them; `at` is moved behind.
constexpr unsigned number_at(Bytes text, std::size_t& at) {
  unsigned number = 0;
  for (unsigned digits = 0; at < text.size() && is_digit(text[at]) && digits < 9; ++at, ++digits) {
    number = number * 10 + static_cast<unsigned>(text[at] - '0');
  }
  return number;
}

constexpr bool skip_to_digit(Bytes text, std::size_t& at) {
  while (at < text.size() && !is_digit(text[at])) ++at;
  return at < text.size();
}

}  // namespace detail

/// The first two numbers with a point between them, wherever they stand.
[[nodiscard]] constexpr std::optional<Version> find_version(Bytes text) {
  for (std::size_t at = 0; detail::skip_to_digit(text, at);) {
    const unsigned major = detail::number_at(text, at);
    if (at + 1 >= text.size() || text[at] != '.' || !detail::is_digit(text[at + 1])) continue;
    return Version{major, detail::number_at(text, ++at)};
  }
  return std::nullopt;
}

/// The first whole number; nothing when there is none.
[[nodiscard]] constexpr std::optional<unsigned> find_number(Bytes text) {
  std::size_t at = 0;
  if (!detail::skip_to_digit(text, at)) return std::nullopt;
  return detail::number_at(text, at);
}

/// The reply to `m`: 1 to 8, or the clock itself in kHz.
[[nodiscard]] constexpr std::optional<unsigned> find_clock(Bytes text) {
  const std::optional<unsigned> number = find_number(text);
  if (!number) return std::nullopt;
  if (*number >= 1 && *number <= clocks_khz.size()) return number;
  for (unsigned i = 0; i < clocks_khz.size(); ++i) {
    if (clocks_khz[i] == *number) return i + 1;
  }
  return std::nullopt;
}

/// Thousandths of the first number that is followed by `unit` (V or A) or by m and `unit`.
[[nodiscard]] constexpr std::optional<unsigned> find_milli(Bytes text, std::uint8_t unit) {
  for (std::size_t at = 0; detail::skip_to_digit(text, at);) {
    std::uint64_t milli = std::uint64_t{detail::number_at(text, at)} * 1000;
    if (at < text.size() && text[at] == '.') {
      unsigned weight = 100;
      for (++at; at < text.size() && detail::is_digit(text[at]); ++at, weight /= 10) {
        milli += weight * static_cast<unsigned>(text[at] - '0');
      }
    }
    std::size_t after = at;
    while (after < text.size() && text[after] == ' ') ++after;
    const bool thousandths = after + 1 < text.size() && text[after] == 'm' && text[after + 1] == unit;
    if (thousandths) return static_cast<unsigned>(milli / 1000);
    if (after < text.size() && text[after] == unit) return static_cast<unsigned>(milli);
  }
  return std::nullopt;
}

/// The reply to `?` (base 10, with sign) or `>` (base 16): the digits of the text. Error: bad_framing.
[[nodiscard]] constexpr Result<std::int64_t> decode_number(Bytes text, unsigned base) {
  text = trimmed(text);
  const bool negative = !text.empty() && text[0] == '-';
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text = text.subspan(1);
  if (text.empty() || text.size() > 20) return Error::bad_framing;
  std::uint64_t number = 0;
  for (const std::uint8_t c : text) {
    const int digit = hex_digit(static_cast<char>(c));
    if (digit < 0 || static_cast<unsigned>(digit) >= base) return Error::bad_framing;
    if (number > (~std::uint64_t{0} - static_cast<unsigned>(digit)) / base) return Error::bad_framing;
    number = number * base + static_cast<unsigned>(digit);
  }
  return static_cast<std::int64_t>(negative ? 0 - number : number);
}

}  // namespace absenc::e201
