// SPDX-License-Identifier: Apache-2.0
// Requests and replies of EnDat 2.1 and 2.2 as bits. Sections are those of README.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/author/bit_engine.hpp"
#include "absenc/protocol/endat/mode_command.hpp"

namespace absenc::endat {

/// A request: mode command with its parameters or its supplement.
struct Request {
  ModeCommand code = ModeCommand::position;  ///< Mode command.
  std::uint8_t byte = 0;                     ///< MRS code, address or port; only with parameters or a supplement.
  std::uint16_t word = 0;  ///< Value to write, or other 16 bits; only with parameters or a supplement.
  /// Not sent: whether the host clocks on for two additional informations, of which it does not know if they are
  /// selected.
  bool seeks_infos = false;
  /// Whether this is a composed request of a capture: behind the position the host reads error messages and warnings.
  bool with_alarms = false;

  /// Returns whether two requests are equal.
  friend constexpr bool operator==(const Request&, const Request&) = default;
};

/// Requests that a host sends behind a position to read the error messages and the warnings.
inline constexpr std::array<Request, 3> alarm_requests{{{.code = ModeCommand::select, .byte = area::status},
                                                        {.code = ModeCommand::read, .byte = error_word.address},
                                                        {.code = ModeCommand::read, .byte = warning_word.address}}};

/// One additional information of a reply.
struct Info {
  bool warning = false;       ///< WRN: at least one warning is set.
  bool referenced = false;    ///< RM: the reference mark was passed.
  bool busy = false;          ///< BUSY: an access to the memory is in progress.
  std::uint8_t number = 0;    ///< The low five bits of the MRS code that selected the content.
  std::uint16_t content = 0;  ///< Content.

  /// Returns whether two informations are equal.
  friend constexpr bool operator==(const Info&, const Info&) = default;
};

/// Words of the operating status, which a host reads behind a position.
struct AlarmWords {
  std::uint16_t errors = 0;    ///< Error messages, word 0.
  std::uint16_t warnings = 0;  ///< Warnings, word 1.

  /// Returns whether the words are equal.
  friend constexpr bool operator==(const AlarmWords&, const AlarmWords&) = default;
};

/// Content of a reply; members that the request does not ask for are 0.
struct Reply {
  std::uint64_t position = 0;   ///< Turns above the position within the turn; of test values: their 40 bits.
  bool f1 = false;              ///< Error bit F1: 1 means an error.
  bool f2 = true;               ///< Error bit F2: 0 means an error.
  std::uint8_t byte = 0;        ///< MRS code, address or port that the encoder repeats.
  std::uint8_t info_count = 0;  ///< Number of additional informations.
  std::uint16_t word = 0;       ///< Content of the word, or the repeated 16 bits.
  std::uint16_t start = 0;      ///< Clocks of the exchange before the start bit.
  std::array<Info, 2> infos{};  ///< Additional informations, in the order of the line: 2 before 1.
  /// Not part of the reply: error messages and warnings that the host read behind the position.
  std::optional<AlarmWords> alarm_words{};

  /// Returns the additional information 1 or 2; null: it was not sent.
  [[nodiscard]] constexpr const Info* info(unsigned number) const {
    // The MRS codes of information 1 are 40 to 4F, those of information 2 50 to 5F: bit 4 tells them apart.
    for (std::size_t i = 0; i < info_count; ++i) {
      if ((infos[i].number >> 4 & 1) + 1u == number) return &infos[i];
    }
    return nullptr;
  }
  /// Returns whether two replies are equal.
  friend constexpr bool operator==(const Reply&, const Reply&) = default;
};

// ---- Sizes, in bits

inline constexpr std::size_t lead_bits = 2;        ///< Clocks before the mode command (2T).
inline constexpr std::size_t command_bits = 8;     ///< Clocks of a request without parameters.
inline constexpr std::size_t parameter_bits = 24;  ///< MRS code, address or port, and 16 bits.
inline constexpr std::size_t turn_bits = 2;        ///< Clocks in which the data line turns (2T).
inline constexpr std::size_t crc_bits = 5;         ///< Bits of the checksum.
/// Bits of a request with parameters; also those of its reply, if the access takes no time.
inline constexpr std::size_t access_bits = command_bits + parameter_bits;
static_assert(access_bits == turn_bits + 1 + parameter_bits + crc_bits);
inline constexpr std::size_t info_bits = 30;        ///< Bits of an additional information.
inline constexpr std::size_t test_value_bits = 40;  ///< Bits of test values.
/// Zeros before the start bit of a supplement; an encoder accepts any number of them.
inline constexpr unsigned supplement_zeros = 7;

/// Returns the number of bits of a request in front of the reply.
[[nodiscard]] constexpr std::size_t request_size(ModeCommand code) {
  return command_bits + (has_parameters(code) ? parameter_bits : 0);
}
/// Returns the number of bits of the position with its error bits and its checksum.
[[nodiscard]] constexpr std::size_t position_size(const Format& format, ModeCommand code) {
  return (is_22(code) ? 2u : 1u) + with_resolution(format).bits() + crc_bits;
}
/// Returns the number of bits behind the start bit of the reply to `code`.
[[nodiscard]] constexpr std::size_t reply_size(const Format& format, ModeCommand code) {
  if (code == ModeCommand::test_values) return 1 + test_value_bits + crc_bits;
  if (!has_position(code)) return parameter_bits + crc_bits;
  return position_size(format, code) + (is_22(code) ? format.infos() * info_bits : 0);
}

// ---- Checksum (section "Checksum")

namespace detail {
// Returns the remainder after one more bit.
constexpr unsigned next_remainder(unsigned remainder, bool bit) {
  const bool feedback = (remainder >> 4 & 1) != (bit ? 1u : 0u);
  return (remainder << 1 & 0x1F) ^ (feedback ? 0x0Bu : 0u);
}
// Remainders after four bits, for each value of the four bits that leave the register.
inline constexpr std::array<std::uint8_t, 16> four_bits = [] {
  std::array<std::uint8_t, 16> table{};
  for (unsigned i = 0; i < table.size(); ++i) {
    unsigned remainder = i << 1;
    for (unsigned bit = 0; bit < 4; ++bit) remainder = next_remainder(remainder, false);
    table[i] = static_cast<std::uint8_t>(remainder);
  }
  return table;
}();
}  // namespace detail

/// Returns the checksum of `count` bits from index `first` on, in the order of the line: x^5 + x^3 + x + 1, all ones at
/// the beginning, inverted.
[[nodiscard]] constexpr std::uint8_t crc_of_bits(const BitView& bits, std::size_t first, std::size_t count) {
  unsigned remainder = 0x1F;
  for (; count % 4 != 0; --count) remainder = detail::next_remainder(remainder, bits[first++]);
  for (; count > 0; count -= 4, first += 4) {
    const unsigned leaving = remainder >> 1 ^ static_cast<unsigned>(bits.load(first, 4));
    remainder = (remainder << 4 & 0x10) ^ detail::four_bits[leaving];
  }
  return static_cast<std::uint8_t>(~remainder & 0x1F);
}

namespace detail {
// Returns the low `count` bits of `value` in reverse order.
constexpr std::uint64_t reversed(std::uint64_t value, unsigned count) {
  value = (value >> 1 & 0x5555'5555'5555'5555) | (value & 0x5555'5555'5555'5555) << 1;
  value = (value >> 2 & 0x3333'3333'3333'3333) | (value & 0x3333'3333'3333'3333) << 2;
  value = (value >> 4 & 0x0F0F'0F0F'0F0F'0F0F) | (value & 0x0F0F'0F0F'0F0F'0F0F) << 4;
  value = (value >> 8 & 0x00FF'00FF'00FF'00FF) | (value & 0x00FF'00FF'00FF'00FF) << 8;
  value = (value >> 16 & 0x0000'FFFF'0000'FFFF) | (value & 0x0000'FFFF'0000'FFFF) << 16;
  value = value >> 32 | value << 32;
  return count == 0 ? 0 : value >> (64 - count);
}
constexpr bool is_checked(const BitView& bits, std::size_t first, std::size_t count) {
  return crc_of_bits(bits, first, count) == bits.load(first + count, crc_bits);
}
}  // namespace detail

// ---- Requests

/// Returns the bits of a request.
[[nodiscard]] constexpr author::HostBits encode_request(const Request& request) {
  author::HostBits bits;
  static_cast<void>(bits.append(static_cast<std::uint8_t>(request.code), command_bits));
  if (has_parameters(request.code)) {
    static_cast<void>(bits.append(request.byte, 8));
    static_cast<void>(bits.append(request.word, 16));
  }
  return bits;
}
/// Returns the bits of the supplement of a request; none if it has no supplement.
[[nodiscard]] constexpr author::HostBits encode_supplement(const Request& request) {
  author::HostBits bits;
  if (!has_supplement(request.code)) return bits;
  static_cast<void>(bits.append(1, supplement_zeros + 1));
  static_cast<void>(bits.append(request.byte, 8));
  static_cast<void>(bits.append(request.word, 16));
  return bits;
}

/// Returns whether two requests with parameters ask for the same area or word.
[[nodiscard]] constexpr bool asks_same(const Request& a, const Request& b) {
  return a.code == b.code && a.byte == b.byte;
}

/// Reads the supplement in `bits` from index `first` on into `request`. Returns false if it is incomplete.
constexpr bool take_supplement(const BitView& bits, std::size_t first, Request& request) {
  const std::size_t start = first < bits.size && !bits[first] ? bits.end_of_run(first) : first;
  if (start + 1 + parameter_bits > bits.size) return false;
  request.byte = static_cast<std::uint8_t>(bits.load(start + 1, 8));
  request.word = static_cast<std::uint16_t>(bits.load(start + 9, 16));
  return true;
}

/// Decodes the bits of a request, with those of its supplement, or a composed request of a capture. Errors:
/// wrong_length, unexpected_reply (no mode command), out_of_range (the two clocks before the mode command are not 0).
[[nodiscard]] constexpr Result<Request> decode_request(const BitView& bits) {
  if (bits.size < command_bits) return Error::wrong_length;
  const auto code = static_cast<std::uint8_t>(bits.load(lead_bits, 6));
  if (!is_code(code)) return Error::unexpected_reply;
  if (bits.load(0, lead_bits) != 0) return Error::out_of_range;
  Request request{.code = static_cast<ModeCommand>(code)};
  if (has_supplement(request.code)) {
    if (!take_supplement(bits, command_bits, request)) return Error::wrong_length;
    return request;
  }
  if (bits.size == command_bits + alarm_requests.size() * access_bits && has_position(request.code)) {
    for (std::size_t i = 0; i < alarm_requests.size(); ++i) {
      const Bytes bytes = bits.bytes.subspan((command_bits + i * access_bits) / 8, access_bits / 8);
      const Result<Request> one = decode_request({bytes, access_bits});
      if (!one || !asks_same(*one, alarm_requests[i])) return Error::wrong_length;
    }
    request.with_alarms = true;
    return request;
  }
  if (bits.size != request_size(request.code)) return Error::wrong_length;
  if (has_parameters(request.code)) {
    request.byte = static_cast<std::uint8_t>(bits.load(command_bits, 8));
    request.word = static_cast<std::uint16_t>(bits.load(command_bits + 8, 16));
  }
  return request;
}

// ---- Replies

/// Returns the index of the start bit in a reply, which begins at the first clock behind the request; `bits.size`:
/// none.
[[nodiscard]] constexpr std::size_t find_start(const BitView& bits) {
  if (bits.size <= turn_bits) return bits.size;
  return bits[turn_bits] ? turn_bits : bits.end_of_run(turn_bits);
}

/// Returns how many bits a reply still needs to be complete.
[[nodiscard]] constexpr std::size_t missing_bits(const Format& format, ModeCommand code, const BitView& bits) {
  const std::size_t start = find_start(bits);
  const std::size_t whole = start + 1 + reply_size(format, code);
  return whole > bits.size ? whole - bits.size : 0;
}

namespace detail {
// Reads the additional informations from index `first` on. The first `expected` of them must be there and valid.
// `seeks`: none is expected, but what is there must be valid, and behind the last one the line must be high.
constexpr Error take_infos(const BitView& bits, std::size_t first, std::size_t expected, bool seeks, Reply& reply) {
  for (; reply.info_count < reply.infos.size(); first += info_bits) {
    const bool required = reply.info_count < expected;
    if (first + info_bits > bits.size) {
      if (required) return Error::truncated;
      break;
    }
    if (bits[first] || !is_checked(bits, first + 1, parameter_bits)) {
      if (required) return Error::bad_checksum;
      break;
    }
    Info& info = reply.infos[reply.info_count++];
    info.warning = bits[first + 1];
    info.referenced = bits[first + 2];
    info.busy = bits[first + 3];
    info.number = static_cast<std::uint8_t>(bits.load(first + 4, 5));
    info.content = static_cast<std::uint16_t>(bits.load(first + 9, 16));
  }
  const bool rests = first >= bits.size || (bits[first] && bits.end_of_run(first) == bits.size);
  return seeks && !rests ? Error::bad_checksum : Error::none;
}
}  // namespace detail

/// Decodes one reply, which begins at the first clock behind the request. Errors: as `decode_reply`.
[[nodiscard]] constexpr Result<Reply> decode_one(const Format& format, const Request& request, const BitView& bits) {
  const std::size_t start = find_start(bits);
  if (start >= bits.size || bits.end_of_run(start) == bits.size) return Error::line_stuck;
  const std::size_t first = start + 1;
  const ModeCommand code = request.code;
  const std::size_t covered = code == ModeCommand::test_values ? 1 + test_value_bits
                              : has_position(code)             ? position_size(format, code) - crc_bits
                                                               : parameter_bits;
  if (first + covered + crc_bits > bits.size) return Error::truncated;
  if (!detail::is_checked(bits, first, covered)) return Error::bad_checksum;
  Reply reply{.start = static_cast<std::uint16_t>(request_size(code) + start)};
  if (!has_position(code) && code != ModeCommand::test_values) {
    reply.byte = static_cast<std::uint8_t>(bits.load(first, 8));
    reply.word = static_cast<std::uint16_t>(bits.load(first + 8, 16));
    const bool repeats = code != ModeCommand::reset && code != ModeCommand::communicate;
    if (repeats && reply.byte != request.byte) return Error::request_rejected;
    if (code == ModeCommand::write && reply.word != request.word) return Error::request_rejected;
    return reply;
  }
  reply.f1 = bits[first];
  if (code == ModeCommand::test_values) {
    reply.position = bits.load(first + 1, test_value_bits);
    return reply;
  }
  const std::size_t error_bits = is_22(code) ? 2 : 1;
  if (error_bits == 2) reply.f2 = bits[first + 1];
  const auto count = static_cast<unsigned>(covered - error_bits);
  reply.position = detail::reversed(bits.load(first + error_bits, count), count);
  if (is_22(code)) {
    const std::size_t expected = request.seeks_infos ? 0 : format.infos();
    const Error error = detail::take_infos(bits, first + covered + crc_bits, expected, request.seeks_infos, reply);
    if (error != Error::none) return error;
  }
  return reply;
}

/// Decodes a reply, which begins at the first clock behind the request, or the composed reply to a composed request:
/// the position up to a whole byte, then the replies to `alarm_requests` without access time. Errors: line_stuck (no
/// start bit, or nothing but ones), truncated, bad_checksum, request_rejected (the encoder repeats another MRS code or
/// address).
[[nodiscard]] constexpr Result<Reply> decode_reply(const Format& format, const Request& request, const BitView& bits) {
  if (!request.with_alarms) return decode_one(format, request, bits);
  constexpr std::size_t size = access_bits / 8;
  if (bits.bytes.size() <= alarm_requests.size() * size) return Error::truncated;
  const std::size_t first = bits.bytes.size() - alarm_requests.size() * size;
  Result<Reply> reply = decode_one(format, request, {bits.bytes.first(first), 8 * first});
  std::array<std::uint16_t, alarm_requests.size()> words{};
  for (std::size_t i = 0; i < alarm_requests.size() && reply; ++i) {
    const Result<Reply> one =
        decode_one(format, alarm_requests[i], {bits.bytes.subspan(first + i * size, size), access_bits});
    if (!one) return one;
    words[i] = one->word;
  }
  if (reply) reply->alarm_words = AlarmWords{words[1], words[2]};
  return reply;
}

/// Appends the bits of a reply from its start bit on to `bits`.
template <class Buffer>
constexpr void encode_reply(const Format& format, ModeCommand code, const Reply& reply, Buffer& bits) {
  static_cast<void>(bits.append(1, 1));
  const auto close = [&bits](std::size_t first) {
    const BitView view = bits.view();
    const std::uint8_t crc = crc_of_bits(view, first, view.size - first);
    static_cast<void>(bits.append(crc, crc_bits));
  };
  const std::size_t first = bits.size();
  if (code == ModeCommand::test_values) {
    static_cast<void>(bits.append(reply.f1 ? 1 : 0, 1));
    static_cast<void>(bits.append(reply.position, test_value_bits));
    return close(first);
  }
  if (!has_position(code)) {
    static_cast<void>(bits.append(reply.byte, 8));
    static_cast<void>(bits.append(reply.word, 16));
    return close(first);
  }
  const unsigned count = with_resolution(format).bits();
  static_cast<void>(bits.append(reply.f1 ? 1 : 0, 1));
  if (is_22(code)) static_cast<void>(bits.append(reply.f2 ? 1 : 0, 1));
  static_cast<void>(bits.append(detail::reversed(reply.position, count), count));
  close(first);
  for (std::size_t i = 0; i < reply.info_count; ++i) {
    const Info& info = reply.infos[i];
    static_cast<void>(bits.append(0, 1));
    const std::size_t begin = bits.size();
    static_cast<void>(bits.append((info.warning ? 4u : 0u) | (info.referenced ? 2u : 0u) | (info.busy ? 1u : 0u), 3));
    static_cast<void>(bits.append(info.number, 5));
    static_cast<void>(bits.append(info.content, 16));
    close(begin);
  }
}

/// Returns the ranges of bits of a burst, from its first clock on, that the host sends.
[[nodiscard]] constexpr BitRanges host_ranges(const Format& format, const BitView& burst) {
  BitRanges ranges;
  const std::size_t command = std::min(command_bits, burst.size);
  const auto code = static_cast<std::uint8_t>(burst.size < command_bits ? 0 : burst.load(lead_bits, 6));
  const std::size_t size = is_code(code) ? std::min(request_size(static_cast<ModeCommand>(code)), burst.size) : command;
  static_cast<void>(ranges.push_back({.first = 0, .count = size}));
  if (!is_code(code) || !has_supplement(static_cast<ModeCommand>(code))) return ranges;
  const BitView reply{burst.bytes.subspan(command_bits / 8), burst.size - size};
  const std::size_t end = size + find_start(reply) + 1 + reply_size(format, static_cast<ModeCommand>(code));
  if (end < burst.size) static_cast<void>(ranges.push_back({.first = end, .count = burst.size - end}));
  return ranges;
}

}  // namespace absenc::endat
