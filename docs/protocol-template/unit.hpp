// SPDX-License-Identifier: Apache-2.0
// Template: frames, checks and times of an invented encoder. README.md draws the frames. Replace them by those of your
// document, and this line by maker and encoder.
#pragma once

#include <cstdint>

#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/look.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::protocol_name {

using namespace std::chrono_literals;

inline constexpr Time answer_limit = 100us;

/// Properties of the encoder's frames that the unit's options select.
struct Format {
  std::uint8_t address = 1;

  [[nodiscard]] constexpr LineSettings line() const { return {.rate = 1'000'000}; }
  [[nodiscard]] constexpr Resolution resolution() const { return {.singleturn_bits = 16}; }
};

enum class Ask : std::uint8_t { position = 0x50, zero = 0x5A };

struct Request {
  Ask ask = Ask::position;
  std::uint8_t address = 1;
};

struct Reply {
  std::uint16_t singleturn = 0;
};

struct Protocol {
  using Format = protocol_name::Format;
  using Request = protocol_name::Request;
  using Reply = protocol_name::Reply;
  static constexpr std::size_t longest_reply = 3;

  static constexpr author::HostTimes host_times(const Format&) {
    return {.answer_limit = answer_limit, .gap_limit = 50us};
  }
  /// Returns how often a request is repeated after an error: requests that change the encoder never.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    return {.repeats = request.ask == Ask::position ? 2u : 0u};
  }

  // Request: code, then address of the encoder.
  static constexpr ByteBuffer<2> encode(const Format&, const Request& request) {
    ByteBuffer<2> bytes;
    bytes.push_back(static_cast<std::uint8_t>(request.ask));
    bytes.push_back(request.address);
    return bytes;
  }
  static constexpr std::size_t request_size(const Format&, Bytes begin) {
    return begin[0] == 0x50 || begin[0] == 0x5A ? 2 : 0;
  }
  static constexpr Result<Request> decode_request(const Format& format, Bytes bytes) {
    if (bytes.size() != 2) return Error::wrong_length;
    if (request_size(format, bytes) == 0) return Error::bad_framing;
    return Request{static_cast<Ask>(bytes[0]), bytes[1]};
  }

  // Reply: position, high byte first, then the sum of all bytes and the address.
  static constexpr std::size_t reply_size(const Format&, const Request&) { return longest_reply; }
  static constexpr std::size_t expected(const Format&, const Request&, Bytes) { return longest_reply; }
  // after an error more bytes may follow, so the host waits for silence
  static constexpr bool is_whole(const Format&, Error) { return false; }
  static constexpr std::uint8_t sum(std::uint8_t address, std::uint8_t high, std::uint8_t low) {
    return static_cast<std::uint8_t>(address + high + low);
  }
  static constexpr ByteBuffer<longest_reply> encode_reply(const Format&, const Request& request, const Reply& reply) {
    const auto high = static_cast<std::uint8_t>(reply.singleturn >> 8);
    const auto low = static_cast<std::uint8_t>(reply.singleturn & 0xFF);
    ByteBuffer<longest_reply> bytes;
    for (const std::uint8_t byte : {high, low, sum(request.address, high, low)}) bytes.push_back(byte);
    return bytes;
  }
  /// Decodes a reply. Put the checks in this order: length, checksum, echo or address, refusal, fixed bits, range,
  /// cross checks.
  static constexpr Result<Reply> decode(const Format&, const Request& request, Bytes bytes) {
    if (bytes.empty()) return Error::timeout;
    if (bytes.size() != longest_reply) return Error::wrong_length;
    if (bytes[2] != sum(request.address, bytes[0], bytes[1])) return Error::bad_checksum;
    return Reply{static_cast<std::uint16_t>(bytes[0] << 8 | bytes[1])};
  }
  static constexpr Reading reading(const Format&, const Request&, const Reply& reply) {
    return author::position_reading(reply.singleturn, 16);
  }
  // The document does not state when the encoder takes the position.
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }

  static constexpr author::DeviceTimes device_times(const Format& format) {
    return {.character = format.line().character(), .answer_time = 10us, .start_time = 100ms};
  }
};

extern const Unit unit;
extern const Clauses unit_clauses;  ///< The demands of its document.

}  // namespace absenc::protocol_name
