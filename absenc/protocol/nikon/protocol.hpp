// SPDX-License-Identifier: Apache-2.0
// Readings of the A-format, and its functions for the templates of absenc/protocol/author.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/angle.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/nikon/frame.hpp"

namespace absenc::nikon {

/// Returns the alarms in the data of a reply to the command code `code`; no value if the reply carries none.
[[nodiscard]] constexpr std::optional<std::uint16_t> alarms_in(Code code, std::uint64_t data) {
  const Code one = single(code);
  if (one == Code::alarms || is_reset(one)) return static_cast<std::uint16_t>(data & alarm::all);
  if (one == Code::with_alarms) return static_cast<std::uint16_t>(data >> 24 & alarm::all);
  return std::nullopt;
}
/// Returns the position within the turn in the data of a reply; no value if the reply does not carry all bits of the
/// position.
[[nodiscard]] constexpr std::optional<std::uint64_t> singleturn_in(const Format& format, Code code,
                                                                   std::uint64_t data) {
  const Code one = single(code);
  const bool is_part = one == Code::lower || one == Code::with_alarms || one == Code::with_temperature;
  const bool is_whole_short = one == Code::short_position && format.singleturn_bits == short_bits;
  if (one != Code::position && !is_part && !is_whole_short) return std::nullopt;
  return data & low_mask(format.singleturn_bits);
}
/// Returns the turns in the data of a reply to the command code `code`; no value if the reply carries none.
[[nodiscard]] constexpr std::optional<std::uint64_t> multiturn_in(const Format& format, Code code, std::uint64_t data) {
  const Code one = single(code);
  if (format.multiturn_bits == 0 || (one != Code::position && one != Code::upper)) return std::nullopt;
  return data >> (one == Code::position ? format.singleturn_bits : format.singleturn_bits - 16);
}

/// Sets the alarms of a reading, and makes the parts invalid that these alarms affect.
constexpr void judge(Reading& reading, std::uint32_t alarms) {
  reading.alarms = alarms;
  reading.alarms_reported = alarm::all;
  reading.singleturn_known = reading.multiturn_known = true;
  reading.singleturn_valid_bits = (alarms & alarm::position_lost) == 0 ? reading.singleturn_bits : 0;
  reading.multiturn_valid = reading.multiturn_bits != 0 && (alarms & alarm::turns_lost) == 0;
}

/// Returns the reading of one encoder's reply. If the reply has no alarms, status 0 is taken to mean that none is
/// raised.
[[nodiscard]] constexpr Reading to_reading(const Format& format, Code code, const OneReply& reply) {
  Reading reading;
  if (const auto singleturn = singleturn_in(format, code, reply.data)) {
    reading.singleturn = *singleturn;
    reading.singleturn_bits = format.singleturn_bits;
  }
  if (const auto multiturn = multiturn_in(format, code, reply.data)) {
    reading.multiturn = *multiturn;
    reading.multiturn_bits = format.multiturn_bits;
  }
  if (const auto alarms = alarms_in(code, reply.data)) {
    judge(reading, *alarms);
  } else if (reply.status == 0) {
    judge(reading, 0);
  } else {
    reading.singleturn_known = reading.multiturn_known = false;
  }
  return reading;
}

/// Returns the reading `now`, completed by alarms that the earlier reading `before` reports, as Unit::remembered
/// describes.
[[nodiscard]] constexpr Reading remembered(const Reading& before, Reading now) {
  if (now.alarms_reported == 0 && before.alarms != 0) judge(now, before.alarms);
  return now;
}

/// Functions of the A-format for the engine and virtual encoders of absenc/protocol/author.
struct Protocol {
  /// Format of the encoder: the values of its options.
  using Format = nikon::Format;
  /// C++ type of the protocol's requests.
  using Request = nikon::Request;
  /// C++ type of the protocol's replies.
  using Reply = nikon::Reply;
  /// Greatest length in bytes of all replies to one request together.
  static constexpr std::size_t longest_reply = encoder_count * longest_one;

  /// Returns the timeouts of a host. Its timeout inside a reply is so long that encoders may be missing between others
  /// that answer in turn.
  static constexpr author::HostTimes host_times(const Format& format) {
    return {.answer_limit = answer_limit, .gap_limit = 8 * slot(format, Code::position), .silence = frame_pause};
  }
  /// Returns how a request is sent: its repetitions and pauses, and how its reply ends.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    const bool changes = is_reset(request.code) || is_write(request.code);
    const bool fetches = request.code == Code::read_memory;
    return {.repeats = changes ? 0u : 2u,
            .pause = fetches ? memory_read_time : Time{},
            .ends_by_silence = is_for_all(request.code),
            .hold = changes   ? memory_write_time
                    : fetches ? memory_read_time
                              : Time{},
            .frame = frames_of(request.code) > 1 ? std::uint8_t{frame_bytes} : std::uint8_t{0},
            .frame_pause = frame_pause};
  }
  /// Returns the bytes of a request.
  static constexpr RequestBytes encode(const Format& format, const Request& request) {
    return encode_request(format, request);
  }
  /// Returns the length in bytes of the request that begins with `begin`. Returns the number of bytes needed to know it
  /// if there are fewer, and 0 if no request begins so.
  static constexpr std::size_t request_size(const Format&, Bytes begin) {
    if (begin.size() < frame_bytes) return frame_bytes;
    const unsigned first = detail::frame_at(begin, 0);
    const std::optional<Code> code = code_of(first >> 8 & 31);
    if (!code || first != detail::request_frame(0, first >> 5 & 0xFF)) return 0;
    return frames_of(*code) * frame_bytes;
  }
  /// Returns the length in bytes of the reply to `request`; 0 if only silence shows its end.
  static constexpr std::size_t expected(const Format&, const Request& request, Bytes) {
    return is_for_all(request.code) ? 0 : reply_length(request.code);
  }
  /// Decodes a request. Returns the request, or the error of the first failed check.
  static constexpr Result<Request> decode_request(const Format& format, Bytes bytes) {
    return decode_captured(format, bytes);
  }
  /// Checks and decodes the bytes of one or several replies.
  static constexpr auto decode = decode_reply;
  /// Returns false: a reply with any error may be incomplete, so the host waits for silence.
  static constexpr bool is_whole(const Format&, Error) { return false; }
  /// Returns position and turns of a valid reply; if several encoders replied, those of the first one.
  static constexpr Reading reading(const Format& format, const Request& request, const Reply& reply) {
    Reading reading = to_reading(format, request.code, reply);
    if (reply.alarms_read) judge(reading, *reply.alarms_read);
    return reading;
  }
  /// Returns the end of the request: no source states when the encoder latches the position.
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }
  /// Returns the times of a virtual encoder, and the shortest pause that it accepts between the frames of a request.
  static constexpr author::DeviceTimes device_times(const Format& format) {
    return {.character = format.line().byte_time(),
            .answer_time = answer_time,
            .gap = 5 * frame_pause,
            .frame = frame_bytes,
            .frame_pause = frame_pause,
            .frame_rule = "frames of a request less than 10 us apart"};
  }
};

}  // namespace absenc::nikon
