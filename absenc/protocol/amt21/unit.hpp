// SPDX-License-Identifier: Apache-2.0
// Frames, checks and times of the CUI AMT21. README.md draws them.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "absenc/core/bits.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/look.hpp"
#include "absenc/protocol/clause.hpp"

namespace absenc::amt21 {

using namespace std::chrono_literals;

/// Baud rates of the line in bits per second.
inline constexpr std::array<std::uint32_t, 5> rates{2'000'000, 115'200, 38'400, 19'200, 9'600};
/// Time from the end of a request to its reply, for each rate in `rates`.
inline constexpr std::array<Time, 5> turn_around{3us, 10'800ns, 30us, 56us, 110us};
inline constexpr Time restart_time = 200ms;  ///< Time that the encoder takes to restart after a zero or reset request.
inline constexpr unsigned turns_bits = 14;   ///< Number of bits of the turns counter.

/// Frame layout and settings of one encoder, as the unit's options select them.
struct Format {
  std::uint8_t singleturn_bits = 14;  ///< Number of bits of the position, 12 or 14.
  std::uint8_t multiturn_bits = 0;    ///< Number of bits of the turns: 14, or 0 for a single-turn encoder.
  std::uint8_t address = 0x54;        ///< Address of the encoder, a multiple of 4.
  std::uint8_t rate = 0;              ///< Index of the baud rate in `rates`.
  /// For 12 bits: whether the two low bits of a position are dropped; false: a reply in which they are not 0 is
  /// refused.
  bool drops_low_bits = false;

  /// Returns the line settings with the baud rate of the format.
  [[nodiscard]] constexpr LineSettings line() const { return {.rate = rates[rate]}; }
  /// Returns the numbers of bits of position and turns.
  [[nodiscard]] constexpr Resolution resolution() const { return {singleturn_bits, multiturn_bits, 0, true}; }
};

/// Kind of request. For position and turns, the value is the difference between the only byte of the request and the
/// encoder's address; for zero and reset, it is the second byte of the request.
enum class Ask : std::uint8_t { position, turns, zero = 0x5E, reset = 0x75 };

/// A request to the encoder.
struct Request {
  Ask ask = Ask::position;      ///< Purpose of the request.
  std::uint8_t address = 0x54;  ///< Address of the encoder, a multiple of 4.

  /// Returns whether the request has a reply.
  [[nodiscard]] constexpr bool is_answered() const { return ask == Ask::position || ask == Ask::turns; }
};

/// A reply: the position in counts, or the turns from -8192 to 8191.
struct Reply {
  std::int32_t value = 0;  ///< Position in counts, or turns, depending on the request.
};

/// Returns whether both check bits are right: K1 (bit 15) makes the number of ones in the odd bits odd, K0 (bit 14)
/// that in the even bits.
[[nodiscard]] constexpr bool parity_is_right(std::uint16_t word) {
  return odd_parity(word & 0xAAAA) && odd_parity(word & 0x5555);
}

/// The AMT21 protocol as the classes of protocol/author use it: frames, lengths and times.
struct Protocol {
  /// Frame layout and settings of one encoder, as the unit's options select them.
  using Format = amt21::Format;
  /// C++ type of the requests to the encoder.
  using Request = amt21::Request;
  /// C++ type of the encoder's replies.
  using Reply = amt21::Reply;
  static constexpr std::size_t longest_reply = 2;  ///< Greatest length of a reply in bytes.

  /// Returns the host's timeouts: for a reply, and between two of its characters.
  static constexpr author::HostTimes host_times(const Format& format) {
    const Time character = format.line().character();
    return {.answer_limit = 2 * turn_around[format.rate] + 2 * character, .gap_limit = 2 * character};
  }
  /// Returns how a request is sent. One wrong reply in four passes the parity bits, so replies end by silence.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    return {
        .repeats = request.is_answered() ? 2u : 0u, .expects_reply = request.is_answered(), .ends_by_silence = true};
  }
  /// Returns the length in bytes of the request that begins with `begin`; 0 if none does.
  static constexpr std::size_t request_size(const Format&, Bytes begin) {
    return std::array<std::size_t, 4>{1, 1, 2, 0}[begin[0] & 3];
  }
  /// Returns the bytes of `request` as they are sent.
  static constexpr ByteBuffer<2> encode(const Format&, const Request& request) {
    ByteBuffer<2> bytes;
    const auto ask = static_cast<std::uint8_t>(request.ask);
    bytes.push_back(static_cast<std::uint8_t>(request.address + (request.is_answered() ? ask : 2)));
    if (!request.is_answered()) bytes.push_back(ask);
    return bytes;
  }
  /// Decodes a request; returns an error if its bytes are invalid.
  static constexpr Result<Request> decode_request(const Format& format, Bytes bytes) {
    if (bytes.empty()) return Error::wrong_length;
    if ((bytes[0] & 3) == 3) return Error::unexpected_reply;  // a first byte whose two lowest bits are 11 is reserved
    if (bytes.size() != request_size(format, bytes)) return Error::wrong_length;
    const Request request{static_cast<Ask>(bytes.size() == 1 ? bytes[0] & 3 : bytes[1]),
                          static_cast<std::uint8_t>(bytes[0] & 0xFC)};
    const bool known = bytes.size() == 1 || request.ask == Ask::zero || request.ask == Ask::reset;
    return known ? Result<Request>(request) : Error::unexpected_reply;
  }
  /// Returns the length of the reply to `request`, in bytes: 2, or 0 if it has no reply.
  static constexpr std::size_t reply_size(const Format&, const Request& request) {
    return request.is_answered() ? 2 : 0;
  }
  /// Returns the length of the reply to `request`, in bytes.
  static constexpr std::size_t expected(const Format& format, const Request& request, Bytes) {
    return reply_size(format, request);
  }
  /// Returns false: no error shows that a reply is complete, because replies end with silence.
  static constexpr bool is_whole(const Format&, Error) { return false; }
  /// Returns the bytes of `reply` as they are sent.
  static constexpr ByteBuffer<2> encode_reply(const Format& format, const Request& request, const Reply& reply) {
    const unsigned shift = request.ask == Ask::position ? 14u - format.singleturn_bits : 0u;
    auto word = static_cast<std::uint16_t>(static_cast<unsigned>(reply.value) << shift & 0x3FFF);
    if (!odd_parity(word & 0xAAAA)) word |= 0x8000;
    if (!odd_parity(word & 0x5555)) word |= 0x4000;
    ByteBuffer<2> bytes;
    bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
    return bytes;
  }
  /// Decodes a reply with all checks; returns the first error if one fails.
  static constexpr Result<Reply> decode(const Format& format, const Request& request, Bytes bytes) {
    if (bytes.empty() && request.is_answered()) return Error::timeout;
    if (bytes.size() != reply_size(format, request)) return Error::wrong_length;
    const auto word = static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8);
    if (!parity_is_right(word)) return Error::bad_checksum;
    const std::int32_t value = word & 0x3FFF;
    if (request.ask == Ask::turns) return Reply{(value ^ 0x2000) - 0x2000};
    const unsigned padding = 14u - format.singleturn_bits;
    if ((value & ((1 << padding) - 1)) != 0 && !format.drops_low_bits) return Error::out_of_range;
    return Reply{value >> padding};
  }
  /// Converts a reply to a reading.
  static constexpr Reading reading(const Format& format, const Request& request, const Reply& reply) {
    if (request.ask == Ask::turns) return author::turns_reading(reply.value, {0, turns_bits, 0, true});
    return author::position_reading(static_cast<std::uint64_t>(reply.value), format.singleturn_bits);
  }
  /// Returns the assumed time at which the encoder latches the position: the end of the request.
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }
  /// Returns the times of the virtual encoder.
  static constexpr author::DeviceTimes device_times(const Format& format) {
    return {format.line().character(), turn_around[format.rate], restart_time};
  }
};

extern const Unit unit;  ///< The AMT21 as a unit, for the list of units.
/// The document's demands on encoders and hosts of the AMT21, for conformance tests.
extern const Clauses unit_clauses;

}  // namespace absenc::amt21
