// SPDX-License-Identifier: Apache-2.0
// Frames of Nikon's A-format: encoding, decoding, and all checks. README.md draws the frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/nikon/format.hpp"

namespace absenc::nikon {

/// A request of the A-format.
struct Request {
  Code code = Code::position;  ///< command code (CC) of the request
  std::uint8_t address = 0;    ///< address of the encoder (EA), 0 to 7; with command codes 11 and 20 its new address
  std::uint8_t word = 0;       ///< for command codes 13 and 14: address of the EEPROM word
  std::uint32_t value = 0;     ///< for command code 14: the word to write; for 18 to 20: the identification, 24 bits
  /// Whether this is a composed request of a capture, in which a request for the alarms (CC 3) follows the first
  /// request.
  bool with_status = false;
  std::uint8_t status_address = 0;  ///< if `with_status`: address in the request for the alarms
};

/// Data of the reply of one encoder.
struct OneReply {
  std::uint8_t address = 0;  ///< address of the encoder (EA) that sent the reply
  /// status bits (ES), whose meanings no source states; one bit in replies to command codes 21 and 22, otherwise four
  std::uint8_t status = 0;
  std::uint64_t data = 0;  ///< data bits of the reply, `data_bits` in number; the first bit of the wire is the lowest
};
/// Replies to a request: one, or those of several encoders in the order of their addresses.
struct Reply : OneReply {
  std::uint8_t count = 1;                            ///< number of replies, 1 to 8
  std::array<OneReply, encoder_count - 1> others{};  ///< the second and later replies
  /// Alarms of the same encoder, if the host has read them with another request (CC 3); otherwise no value.
  std::optional<std::uint16_t> alarms_read{};
  /// Returns the reply number `index`, below `count`.
  [[nodiscard]] constexpr const OneReply& at(std::size_t index) const { return index == 0 ? *this : others[index - 1]; }
};

inline constexpr std::size_t frame_bytes = 2;  ///< number of bytes of a frame, which is one character of 16 bits
inline constexpr std::size_t longest_one = 8;  ///< length in bytes of the longest reply of one encoder
/// Buffer for the bytes of a request.
using RequestBytes = ByteBuffer<4 * frame_bytes>;
/// Buffer for the bytes of one encoder's reply.
using OneReplyBytes = ByteBuffer<longest_one>;

namespace detail {

inline constexpr unsigned request_sync = 2;  // sync code of requests, 010 with its first bit on the left
inline constexpr unsigned reply_sync = 4;    // sync code of replies, 001 with its first bit on the left

// Returns the CRC-3 (x^3 + x + 1, start 0) of the ten bits of a request frame that follow its sync code.
[[nodiscard]] constexpr unsigned crc3(unsigned frame) {
  unsigned crc = 0;
  for (unsigned i = 3; i < 13; ++i) {
    const bool feeds = ((crc >> 2 ^ frame >> i) & 1) != 0;
    crc = (crc << 1 & 7) ^ (feeds ? 3u : 0u);
  }
  return crc;
}
// Returns a request frame with its CRC-3, whose highest bit is sent first.
[[nodiscard]] constexpr unsigned request_frame(unsigned frame_code, unsigned bits) {
  const unsigned frame = request_sync | frame_code << 3 | bits << 5;
  return frame | static_cast<unsigned>(reflect(crc3(frame), 3)) << 13;
}
[[nodiscard]] constexpr unsigned frame_at(Bytes bytes, std::size_t index) {
  return bytes[2 * index] | static_cast<unsigned>(bytes[2 * index + 1]) << 8;
}
constexpr void push_frame(auto& bytes, unsigned frame) {
  bytes.push_back(static_cast<std::uint8_t>(frame));
  bytes.push_back(static_cast<std::uint8_t>(frame >> 8));
}
// Returns the eight data bits of the memory frame (MDF) with the frame code `frame_code`, 1 to 3.
[[nodiscard]] constexpr unsigned memory_bits(const Request& request, std::uint32_t sent, unsigned frame_code) {
  if (frame_code == 3 && is_memory_access(request.code)) return request.word;
  return sent >> 8 * (frame_code - 1) & 0xFF;
}

}  // namespace detail

/// Converts an EEPROM word or an identification to the order of its bits on the wire, or back.
[[nodiscard]] constexpr std::uint32_t in_bit_order(const Format& format, Code code, std::uint32_t sent) {
  const unsigned bits = is_memory_access(code) ? 16 : 24;
  const auto value = static_cast<std::uint32_t>(sent & low_mask(bits));
  return format.bit_order == BitOrder::low_first ? value : static_cast<std::uint32_t>(reflect(value, bits));
}

/// Parameters of the CRC-8 of replies: x^8 + x^4 + x^3 + x^2 + 1, start 0.
inline constexpr CrcParameters crc_parameters{8, 0x1D, 0, true, true, 0};
/// Returns the CRC-8 of `bytes`, the bytes of a reply before its CRC, as the byte that is sent behind them.
[[nodiscard]] constexpr std::uint8_t checksum(Bytes bytes) { return Crc<crc_parameters, CrcTable::nibble>::of(bytes); }

/// Returns the bytes of a request.
[[nodiscard]] constexpr RequestBytes encode_request(const Format& format, const Request& request) {
  RequestBytes bytes;
  detail::push_frame(bytes, detail::request_frame(0, request.address | static_cast<unsigned>(request.code) << 3));
  const auto frames = static_cast<unsigned>(frames_of(request.code));
  const std::uint32_t sent = in_bit_order(format, request.code, request.value);
  for (unsigned frame_code = 5 - frames; frames > 1 && frame_code <= 3; ++frame_code) {
    detail::push_frame(bytes, detail::request_frame(frame_code, detail::memory_bits(request, sent, frame_code)));
  }
  return bytes;
}

/// Decodes a request. Errors: wrong_length, bad_framing, bad_checksum, unsupported.
[[nodiscard]] constexpr Result<Request> decode_request(const Format& format, Bytes bytes) {
  if (bytes.size() < frame_bytes || bytes.size() % frame_bytes != 0) return Error::wrong_length;
  for (std::size_t i = 0; i < bytes.size() / frame_bytes; ++i) {
    const unsigned frame = detail::frame_at(bytes, i);
    if ((frame & 7) != detail::request_sync) return Error::bad_framing;
    if (frame != detail::request_frame(frame >> 3 & 3, frame >> 5 & 0xFF)) return Error::bad_checksum;
  }
  const unsigned first = detail::frame_at(bytes, 0);
  if ((first >> 3 & 3) != 0) return Error::bad_framing;
  const std::optional<Code> code = code_of(first >> 8 & 31);
  if (!code) return Error::unsupported;
  Request request{.code = *code, .address = static_cast<std::uint8_t>(first >> 5 & 7)};
  const std::size_t frames = frames_of(*code);
  if (bytes.size() != frames * frame_bytes) return Error::wrong_length;
  std::uint32_t sent = 0;
  for (std::size_t i = 1; i < frames; ++i) {
    const unsigned frame = detail::frame_at(bytes, i);
    const auto frame_code = static_cast<unsigned>(4 - frames + i);
    if ((frame >> 3 & 3) != frame_code) return Error::bad_framing;
    const unsigned bits = frame >> 5 & 0xFF;
    if (frame_code == 3 && is_memory_access(*code)) {
      request.word = static_cast<std::uint8_t>(bits);
    } else {
      sent |= bits << 8 * (frame_code - 1);
    }
  }
  request.value = in_bit_order(format, *code, sent);
  return request;
}

/// Decodes a request of a capture, which may be composed of a request and one for the alarms. Errors: as
/// `decode_request`.
[[nodiscard]] constexpr Result<Request> decode_captured(const Format& format, Bytes bytes) {
  const Result<Request> whole = decode_request(format, bytes);
  if (whole || bytes.size() != 2 * frame_bytes) return whole;
  Result<Request> first = decode_request(format, bytes.first(frame_bytes));
  const Result<Request> second = decode_request(format, bytes.subspan(frame_bytes));
  if (!first || !second || second->code != Code::alarms) return whole;
  first->with_status = true;
  first->status_address = second->address;
  return first;
}

/// Returns the bytes of one encoder's reply to a request with this command code.
[[nodiscard]] constexpr OneReplyBytes encode_reply(Code code, const OneReply& reply) {
  const unsigned begin = detail::reply_sync | static_cast<unsigned>(reply.address) << 3;
  OneReplyBytes bytes;
  if (single(code) == Code::short_position) {
    const auto low_bits = static_cast<unsigned>(reply.data & 0x1FF);
    detail::push_frame(bytes, begin | (reply.status != 0 ? 1u : 0u) << 6 | low_bits << 7);
    bytes.push_back(static_cast<std::uint8_t>(reply.data >> 9));
  } else {
    detail::push_frame(bytes, begin | static_cast<unsigned>(code) << 6 | static_cast<unsigned>(reply.status) << 12);
    for (unsigned at = 0; at < data_bits(code); at += 8) {
      bytes.push_back(static_cast<std::uint8_t>(reply.data >> at));
    }
  }
  bytes.push_back(checksum(bytes));
  return bytes;
}

namespace detail {

[[nodiscard]] constexpr std::uint8_t address_in(Bytes reply) { return frame_at(reply, 0) >> 3 & 7; }
[[nodiscard]] constexpr OneReply split_one(Code code, Bytes bytes) {
  const unsigned info = frame_at(bytes, 0);
  if (single(code) == Code::short_position) {
    return {.address = address_in(bytes),
            .status = static_cast<std::uint8_t>(info >> 6 & 1),
            .data = info >> 7 | std::uint64_t{bytes[2]} << 9};
  }
  OneReply reply{.address = address_in(bytes), .status = static_cast<std::uint8_t>(info >> 12)};
  for (std::size_t i = 2; i + 1 < bytes.size(); ++i) reply.data |= std::uint64_t{bytes[i]} << 8 * (i - 2);
  return reply;
}
// Checks CRC, sync code, command code and the bit that must be 0 in one encoder's reply, whose length must be right.
[[nodiscard]] constexpr Error check_one(Code code, Bytes bytes) {
  if (checksum(bytes.first(bytes.size() - 1)) != bytes.back()) return Error::bad_checksum;
  const unsigned info = frame_at(bytes, 0);
  if ((info & 7) != reply_sync) return Error::bad_framing;
  if (single(code) == Code::short_position) return Error::none;
  if ((info >> 6 & 31) != static_cast<unsigned>(code)) return Error::unexpected_reply;
  return (info >> 11 & 1) == 0 ? Error::none : Error::unexpected_reply;
}
[[nodiscard]] constexpr Error check_range(const Format& format, Code code, std::uint64_t data) {
  const unsigned all_bits = format.singleturn_bits + format.multiturn_bits;
  const auto bits_above = [&](std::uint64_t value, unsigned bits) {
    return value >> bits == 0 ? Error::none : Error::out_of_range;
  };
  const Code one = single(code);
  if (one == Code::position) return bits_above(data, all_bits);
  if (one == Code::upper) return bits_above(data, all_bits - 16);
  if (one == Code::alarms || is_reset(one)) return bits_above(data, 16);
  const bool is_lower = one == Code::lower || one == Code::with_alarms || one == Code::with_temperature;
  if (is_lower) return bits_above(data & 0xFFFFFF, all_bits);
  return Error::none;
}

}  // namespace detail

/// Checks and decodes the reply of one encoder, or the replies of several. Errors: wrong_length, bad_checksum,
/// bad_framing, unexpected_reply, out_of_range.
[[nodiscard]] constexpr Result<Reply> decode_replies(const Format& format, const Request& request, Bytes bytes) {
  const std::size_t size = reply_length(request.code);
  const bool all = is_for_all(request.code);
  if (bytes.empty() || bytes.size() % size != 0 || bytes.size() > (all ? encoder_count : 1) * size) {
    return Error::wrong_length;
  }
  Reply reply;
  reply.count = 0;
  for (; !bytes.empty(); bytes = bytes.subspan(size)) {
    const Bytes one = bytes.first(size);
    if (const Error error = detail::check_one(request.code, one); error != Error::none) return error;
    const OneReply now = detail::split_one(request.code, one);
    const bool is_next = all ? reply.count == 0 || now.address > reply.at(reply.count - 1u).address
                             : is_for_any_address(request.code) || now.address == request.address;
    if (!is_next) return Error::unexpected_reply;
    if (const Error error = detail::check_range(format, request.code, now.data); error != Error::none) return error;
    if (reply.count == 0) {
      static_cast<OneReply&>(reply) = now;
    } else {
      reply.others[reply.count - 1u] = now;
    }
    ++reply.count;
  }
  return reply;
}

/// Checks and decodes the reply to a request, also to a composed request of a capture (`with_status`). Errors: as
/// `decode_replies`.
[[nodiscard]] constexpr Result<Reply> decode_reply(const Format& format, const Request& request, Bytes bytes) {
  if (!request.with_status) return decode_replies(format, request, bytes);
  constexpr std::size_t alarms_size = reply_length(Code::alarms);
  if (bytes.size() <= alarms_size) return Error::wrong_length;
  Result<Reply> reply = decode_replies(format, request, bytes.first(bytes.size() - alarms_size));
  if (!reply) return reply;
  if (reply->count != 1 || reply->address != request.status_address) return Error::unexpected_reply;
  const Result<Reply> alarms =
      decode_replies(format, {.code = Code::alarms, .address = reply->address}, bytes.last(alarms_size));
  if (!alarms) return alarms;
  reply->alarms_read = static_cast<std::uint16_t>(alarms->data & alarm::all);
  return reply;
}

/// Returns the likely length in bytes of the reply that begins with `begin`. Returns the number of bytes needed to know
/// it if there are fewer, and 0 if no reply begins so.
[[nodiscard]] constexpr std::size_t reply_size(Bytes begin) {
  if (begin.size() < frame_bytes) return frame_bytes;
  const unsigned info = detail::frame_at(begin, 0);
  if ((info & 7) != detail::reply_sync) return 0;
  const std::optional<Code> code = code_of(info >> 6 & 31);
  const bool is_short = !code || (info >> 11 & 1) != 0;
  return reply_length(is_short ? Code::short_position : *code);
}
/// Returns the request that a reply of one encoder probably answers. Errors: wrong_length, unexpected_reply.
[[nodiscard]] constexpr Result<Request> request_of_reply(Bytes reply) {
  if (reply.size() < reply_length(Code::short_position)) return Error::wrong_length;
  Request request{.code = Code::short_position, .address = detail::address_in(reply)};
  if (reply.size() == reply_length(Code::short_position)) return request;
  const std::optional<Code> code = code_of(detail::frame_at(reply, 0) >> 6 & 31);
  if (!code) return Error::unexpected_reply;
  request.code = *code;
  return request;
}

}  // namespace absenc::nikon
