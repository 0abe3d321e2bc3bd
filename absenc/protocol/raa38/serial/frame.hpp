// SPDX-License-Identifier: Apache-2.0
// Frames, checks and times of the RAA38S6 on asynchronous lines; README.md draws the frames.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/author/look.hpp"

namespace absenc::raa38::serial {

using namespace std::chrono_literals;

/// Event that makes the encoder send a frame.
enum class Mode : std::uint8_t {
  timing,     ///< The end of each period of the refresh rate: the encoder sends without a request.
  handshake,  ///< A falling edge on the encoder's input CLK.
  bus,        ///< A request that contains the encoder's number.
};

/// Second byte of a frame: 81 (fixed), Bx with the encoder's number x (echo), or either of these (automatic).
enum class SecondByte : std::uint8_t { automatic, fixed, echo };

/// How the zero of an encoder is set; the order code of the encoder decides it.
enum class Zeroing : std::uint8_t {
  none,
  line,     ///< The zero is set by a pulse on the wire CLR.
  command,  ///< The zero is set by the request BC AA Cx, on a bus.
};

inline constexpr std::uint8_t header = 0xFF;  ///< First byte of each frame.
/// Second byte of a frame that does not contain the encoder's number.
inline constexpr std::uint8_t fixed_second_byte = 0x81;
/// High digit of the third byte Bx in a request that reads the position of the encoder with the number x.
inline constexpr std::uint8_t number_mark = 0xB0;
/// High digit of the third byte Cx in a request that sets the zero of the encoder with the number x.
inline constexpr std::uint8_t clear_mark = 0xC0;
/// Greatest number of encoders on a bus: the number of an encoder is one hexadecimal digit.
inline constexpr unsigned unit_count = 16;
inline constexpr unsigned least_bits = 10;  ///< Lowest number of position bits with which an encoder can be ordered.
/// Highest number of position bits with which an encoder can be ordered.
inline constexpr unsigned most_bits = 21;
inline constexpr std::size_t request_bytes = 3;   ///< Length of a request in bytes.
inline constexpr std::size_t frame_capacity = 6;  ///< Length of the longest frame in bytes.

// ---- Times. The document states only T2; all others are assumed.

inline constexpr Time trigger_width = 10us;  ///< Time T2: shortest pulse on CLK (3.1.3).
inline constexpr Time clear_width = 1ms;     ///< Duration of the pulse on CLR, which sets the zero.

// The next times are those of the host.
/// Timeout of a reply if the options do not state T3.
inline constexpr Time answer_limit = 100ms;
/// Time that the host adds to the T3 of the options to get the timeout of a reply.
inline constexpr Time answer_slack = 5ms;
inline constexpr Time gap_limit = 10ms;  ///< Shortest timeout between two characters of a frame; suits 1200 baud.
inline constexpr Time patience = 1s;  ///< Timeout on a line that is never silent; two frames at 1200 baud take 100 ms.
/// Shortest time without a valid frame after which listening to a stream fails.
inline constexpr Time listen_limit = 1s;
/// Time for which the host listens before a scan; longer than the period of most refresh rates.
inline constexpr Time scan_silence = 200ms;
inline constexpr Time zero_limit = 500ms;  ///< Time within which the position must become zero after zero clearing.
inline constexpr Time zero_poll = 10ms;    ///< Pause before each poll of the position after zero clearing.

// The next times are those of the virtual encoder; options may set another period and another T3.
inline constexpr Time virtual_period = 10ms;  ///< Time between the virtual encoder's frames: refresh rate 100 Hz.
/// Default time T3 of the virtual encoder, from request or pulse to its frame.
inline constexpr Time virtual_acquisition = 100us;
inline constexpr Time most_backlog = 2s;  ///< Delay above which a stream of the virtual encoder drops frames.
/// Silence after which the virtual encoder drops an incomplete request.
inline constexpr Time request_gap = 2ms;

/// Properties with which an encoder was ordered, as the unit's options select them.
struct Format {
  unsigned bits = 14;                              ///< Number of bits of the position in a turn, 10 to 21.
  SecondByte second_byte = SecondByte::automatic;  ///< Rule for the second byte of the encoder's frames.
  Mode mode = Mode::timing;                        ///< Event on which the encoder sends a frame.
  std::uint8_t unit = 1;                           ///< Number of the encoder on a bus, 0 to 15.
  Zeroing zeroing = Zeroing::none;                 ///< How the zero of the encoder is set.
  /// Number x in the request BC AA Cx that sets the zero; -1: the encoder's number, `unit`.
  std::int32_t zero_unit = -1;
  std::int64_t refresh_millihertz = 0;  ///< Frames per second in timing mode, in 0.001 Hz; 0: unknown.
  /// Time T3 from the pulse on CLK, or from a request on a bus, to the frame; 0: unknown.
  Time acquisition{};
  /// Time T1 - T3, the duration of a frame; 0: as long as its characters take.
  Time transmission{};

  /// Returns the number of data bytes of a frame.
  [[nodiscard]] constexpr std::size_t data_bytes() const { return bits <= 16 ? 2 : 3; }
  /// Returns the length of a frame in bytes.
  [[nodiscard]] constexpr std::size_t frame_bytes() const { return data_bytes() + 3; }
  /// Returns the time between two frames in timing mode; 0: unknown.
  [[nodiscard]] constexpr Time period() const {
    return refresh_millihertz > 0 ? Time(1'000'000'000'000 / refresh_millihertz) : Time{};
  }
  /// Returns the number of the encoder in a request that sets its zero.
  [[nodiscard]] constexpr std::uint8_t zeroed_unit() const {
    return zero_unit < 0 ? unit : static_cast<std::uint8_t>(zero_unit);
  }
  /// Returns the second byte that frames of a stream and of the virtual encoder have: Bx for `echo`, otherwise 81.
  [[nodiscard]] constexpr std::uint8_t own_second_byte() const {
    return second_byte == SecondByte::echo ? static_cast<std::uint8_t>(number_mark | unit) : fixed_second_byte;
  }
};

/// A decoded frame: the position that the encoder sent, and the second byte of the frame.
struct Position {
  std::uint32_t singleturn = 0;                  ///< Position within the turn, in counts.
  std::uint8_t second_byte = fixed_second_byte;  ///< Second byte of the frame.

  /// Returns whether two positions and their second bytes are equal.
  friend constexpr bool operator==(const Position&, const Position&) = default;
};

/// Buffer for the bytes of one frame.
using FrameBytes = ByteBuffer<frame_capacity>;
/// Buffer for the bytes of one request.
using RequestBytes = ByteBuffer<request_bytes>;

/// Returns the checksum of `bytes`; it does not depend on their order.
[[nodiscard]] constexpr std::uint8_t checksum(Bytes bytes) {
  unsigned sum = 0;
  for (const std::uint8_t byte : bytes) sum += byte;
  return static_cast<std::uint8_t>(sum);
}

/// Returns the frame that carries `position`.
[[nodiscard]] constexpr FrameBytes encode_position(const Format& format, const Position& position) {
  FrameBytes bytes;
  bytes.push_back(header);
  bytes.push_back(position.second_byte);
  for (std::size_t i = format.data_bytes(); i > 0; --i) {
    bytes.push_back(static_cast<std::uint8_t>(position.singleturn >> 8 * (i - 1)));
  }
  bytes.push_back(checksum(bytes));
  return bytes;
}

/// Value of the argument `unit` with which decoding accepts a frame of an encoder with any number.
inline constexpr int any_unit = -1;

/// Returns whether `second_byte` is valid in a frame of the encoder with the number `unit`, 0 to 15, or `any_unit`.
[[nodiscard]] constexpr bool second_byte_fits(const Format& format, int unit, std::uint8_t second_byte) {
  const bool numbered = unit == any_unit ? (second_byte & 0xF0) == number_mark : second_byte == (number_mark | unit);
  if (format.second_byte == SecondByte::fixed) return second_byte == fixed_second_byte;
  return numbered || (format.second_byte == SecondByte::automatic && second_byte == fixed_second_byte);
}

/// Decodes a frame of the encoder with the number `unit`, 0 to 15, or of any encoder (`any_unit`). Errors:
/// wrong_length, bad_checksum, unexpected_reply, out_of_range.
[[nodiscard]] constexpr Result<Position> decode_position(const Format& format, Bytes bytes, int unit = any_unit) {
  if (bytes.size() != format.frame_bytes()) return Error::wrong_length;
  if (checksum(bytes.first(bytes.size() - 1)) != bytes.back()) return Error::bad_checksum;
  if (bytes[0] != header || !second_byte_fits(format, unit, bytes[1])) return Error::unexpected_reply;
  const auto value = static_cast<std::uint32_t>(load_big_endian(bytes.subspan(2, format.data_bytes())));
  if (value > low_mask(format.bits)) return Error::out_of_range;
  return Position{value, bytes[1]};
}

/// A request to the encoder: three bytes, or a pulse on CLK or CLR.
struct Request {
  /// Kinds of requests.
  enum class Kind : std::uint8_t {
    read,                 ///< The bytes BC AA Bx: read the position of encoder x.
    zero_clear,           ///< The bytes BC AA Cx: set the zero of encoder x.
    trigger,              ///< A pulse on CLK, without bytes: send a frame.
    clear,                ///< A pulse on CLR, without bytes: set the zero.
  } kind = Kind::read;    ///< Purpose of the request.
  std::uint8_t unit = 0;  ///< Number of the encoder in the bytes of a request, 0 to 15.
};

/// Returns the bytes of a request; empty for a pulse.
[[nodiscard]] constexpr RequestBytes encode_request(const Request& request) {
  RequestBytes bytes;
  if (request.kind == Request::Kind::trigger || request.kind == Request::Kind::clear) return bytes;
  bytes.push_back(0xBC);
  bytes.push_back(0xAA);
  const unsigned mark = request.kind == Request::Kind::read ? number_mark : clear_mark;
  bytes.push_back(static_cast<std::uint8_t>(mark | (request.unit & 0x0Fu)));
  return bytes;
}

/// Decodes a request. Errors: wrong_length, unexpected_reply.
[[nodiscard]] constexpr Result<Request> decode_request(Bytes bytes) {
  if (bytes.size() != request_bytes) return Error::wrong_length;
  const unsigned mark = bytes[2] & 0xF0u;
  if (bytes[0] != 0xBC || bytes[1] != 0xAA || (mark != number_mark && mark != clear_mark)) {
    return Error::unexpected_reply;
  }
  return Request{mark == number_mark ? Request::Kind::read : Request::Kind::zero_clear,
                 static_cast<std::uint8_t>(bytes[2] & 0x0Fu)};
}

/// Values that a frame contains, or that a command gives as its result. Only members that have a value are reported.
struct Values {
  std::optional<std::uint8_t> encoder_address{};  ///< Scan: number of an encoder that answered, 0 to 15.
  /// Scan: true if all answers from this number were invalid, because two encoders have the number or the line is bad.
  std::optional<bool> clash{};
  std::optional<std::uint32_t> before{};      ///< Position before the zero was set, in counts.
  std::optional<std::uint32_t> singleturn{};  ///< Position within the turn, in counts.
  /// Second byte of the frame: 81, or Bx with the encoder's number.
  std::optional<std::uint8_t> second_byte{};
  std::optional<double> angle{};              ///< Position within the turn, in degrees.
  std::optional<std::string_view> command{};  ///< Name of the request: read or zero_clear.
  std::optional<std::uint8_t> unit{};         ///< Number of the encoder in the request, 0 to 15.
  std::optional<std::uint64_t> skipped{};     ///< Number of received bytes that belong to no valid frame.
};

/// Returns the Values that report the position and the second byte of a frame.
[[nodiscard]] constexpr Values values_of(const Format& format, const Position& position) {
  return {.singleturn = position.singleturn,
          .second_byte = position.second_byte,
          .angle = degrees(position.singleturn, format.bits)};
}

/// Types, frames, lengths and times that the classes in absenc/protocol/author require.
struct Protocol {
  /// Frame layout and settings of one encoder, as the unit's options select them.
  using Format = serial::Format;
  /// C++ type of the requests to the encoder.
  using Request = serial::Request;
  /// C++ type of the encoder's replies.
  using Reply = Position;
  static constexpr std::size_t longest_reply = frame_capacity;  ///< Greatest length of a reply in bytes.

  /// Returns the host's timeouts.
  static constexpr author::HostTimes host_times(const Format& format) {
    return {.answer_limit = format.acquisition > Time{} ? format.acquisition + answer_slack : answer_limit,
            .gap_limit = std::max(format.transmission, gap_limit),
            .patience = patience};
  }
  /// Returns how a host sends a request: as bytes or as a pulse, and whether a reply is expected.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    switch (request.kind) {
      case Request::Kind::trigger:
        return {.pulse = trigger_width, .wire = ExtraWire::trigger};
      case Request::Kind::clear:
        return {.expects_reply = false, .pulse = clear_width, .wire = ExtraWire::clear};
      default:
        return {.expects_reply = request.kind == Request::Kind::read};
    }
  }
  /// Returns the bytes of `request` as they are sent.
  static constexpr RequestBytes encode(const Format&, const Request& request) { return encode_request(request); }
  /// Decodes a request; returns an error if its bytes are invalid.
  static constexpr Result<Request> decode_request(const Format&, Bytes bytes) { return serial::decode_request(bytes); }
  /// Returns the length of a request in bytes; 0 if the bytes in `begin` do not begin a request.
  static constexpr std::size_t request_size(const Format&, Bytes begin) {
    const RequestBytes request = encode_request({});
    return begin[0] == request[0] && (begin.size() < 2 || begin[1] == request[1]) ? request_bytes : 0;
  }
  /// Returns the length in bytes of the reply to `request`; 0 if the request has no reply.
  static constexpr std::size_t reply_size(const Format& format, const Request& request) {
    return request.kind == Request::Kind::zero_clear ? 0 : format.frame_bytes();
  }
  /// Returns the length of a reply in bytes; it depends only on the format.
  static constexpr std::size_t expected(const Format& format, const Request&, Bytes) { return format.frame_bytes(); }
  /// Returns false: a reply with an error may be incomplete, so the host awaits more bytes.
  static constexpr bool is_whole(const Format&, Error) { return false; }
  /// Returns the bytes of the frame that carries `position`.
  static constexpr FrameBytes encode_reply(const Format& format, const Request&, const Position& position) {
    return encode_position(format, position);
  }
  /// Decodes a reply with all checks; returns the first error if one fails.
  static constexpr Result<Position> decode(const Format& format, const Request& request, Bytes bytes) {
    // The encoder sends no reply when its zero is set, so no reply is valid.
    if (request.kind == Request::Kind::zero_clear) return Error::unexpected_reply;
    return decode_position(format, bytes, request.kind == Request::Kind::read ? request.unit : any_unit);
  }
  /// Converts a reply to a reading.
  static constexpr Reading reading(const Format& format, const Request&, const Position& position) {
    return author::position_reading(position.singleturn, format.bits);
  }
  /// Returns `sent_at`, the end of the request, as the time at which the encoder latched the position; the document
  /// does not state that time.
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }
  /// Returns the times of the virtual encoder: until its frame, and until it drops an incomplete request.
  static constexpr author::DeviceTimes device_times(const Format& format) {
    return {.answer_time = format.acquisition > Time{} ? format.acquisition : virtual_acquisition, .gap = request_gap};
  }
};

/// Returns the request that makes the encoder send its position: the bytes BC AA Bx or a pulse.
[[nodiscard]] constexpr Request position_request(const Format& format) {
  return {format.mode == Mode::bus ? Request::Kind::read : Request::Kind::trigger, format.unit};
}

/// Reads one position of an encoder that sends on a request or a pulse.
using ReadPosition = author::ReadPosition<Protocol>;

}  // namespace absenc::raa38::serial
