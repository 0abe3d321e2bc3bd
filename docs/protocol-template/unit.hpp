// SPDX-License-Identifier: Apache-2.0
// Template: frames, checks and times of an invented encoder. README.md draws the frames. Replace them by those of your
// document, and this line by maker and encoder.
#pragma once

#include <cstdint>

#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/look.hpp"
#include "absenc/protocol/clause.hpp"

/// Maker and encoder.
namespace absenc::protocol_name {

using namespace std::chrono_literals;

inline constexpr Time answer_limit = 100us;

/// Properties of the encoder's frames that the unit's options select.
struct Format {
  std::uint8_t address = 1;

  [[nodiscard]] constexpr LineSettings line() const { return {.rate = 1'000'000}; }
  [[nodiscard]] constexpr Resolution resolution() const { return {.singleturn_bits = 16}; }
};

enum class Ask : std::uint8_t { position = 0x50, zero = 0xAF };

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
  static constexpr std::size_t longest_reply = 4;

  static constexpr author::HostTimes host_times(const Format&) {
    return {.answer_limit = answer_limit, .gap_limit = 50us};
  }
  /// Returns how often a request is repeated after an error. Requests that change the encoder are never repeated.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    return {.repeats = request.ask == Ask::position ? 2u : 0u};
  }

  static constexpr std::uint8_t sum(Bytes bytes) {
    unsigned sum = 0;
    for (const std::uint8_t byte : bytes) sum += byte;
    return static_cast<std::uint8_t>(sum & 0xFF);
  }

  // A request: code, address of the encoder, and the sum of both.
  static constexpr ByteBuffer<3> encode(const Format&, const Request& request) {
    ByteBuffer<3> bytes;
    bytes.push_back(static_cast<std::uint8_t>(request.ask));
    bytes.push_back(request.address);
    bytes.push_back(sum(bytes));
    return bytes;
  }
  static constexpr std::size_t request_size(const Format&, Bytes begin) {
    return begin[0] == 0x50 || begin[0] == 0xAF ? 3 : 0;
  }
  static constexpr Result<Request> decode_request(const Format& format, Bytes bytes) {
    if (bytes.size() != 3) return Error::wrong_length;
    if (bytes[2] != sum(bytes.first(2))) return Error::bad_checksum;
    if (request_size(format, bytes) == 0) return Error::bad_framing;
    return Request{static_cast<Ask>(bytes[0]), bytes[1]};
  }

  // A reply: address of the encoder, position with its high byte first, and the sum of these bytes.
  static constexpr std::size_t reply_size(const Format&, const Request&) { return longest_reply; }
  static constexpr std::size_t expected(const Format&, const Request&, Bytes) { return longest_reply; }
  // after an error more bytes may follow, so the host waits for silence
  static constexpr bool is_whole(const Format&, Error) { return false; }
  static constexpr ByteBuffer<longest_reply> encode_reply(const Format&, const Request& request, const Reply& reply) {
    ByteBuffer<longest_reply> bytes;
    bytes.push_back(request.address);
    bytes.push_back(static_cast<std::uint8_t>(reply.singleturn >> 8));
    bytes.push_back(static_cast<std::uint8_t>(reply.singleturn & 0xFF));
    bytes.push_back(sum(bytes));
    return bytes;
  }
  /// Decodes a reply. Put the checks in this order: length, checksum, echo or address, refusal, fixed bits, range,
  /// cross checks.
  static constexpr Result<Reply> decode(const Format&, const Request& request, Bytes bytes) {
    if (bytes.empty()) return Error::timeout;
    if (bytes.size() != longest_reply) return Error::wrong_length;
    if (bytes[3] != sum(bytes.first(3))) return Error::bad_checksum;
    if (bytes[0] != request.address) return Error::unexpected_reply;
    return Reply{static_cast<std::uint16_t>(bytes[1] << 8 | bytes[2])};
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
extern const Clauses unit_clauses;  ///< The demands of the encoder's document.

}  // namespace absenc::protocol_name
