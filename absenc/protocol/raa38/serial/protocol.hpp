// SPDX-License-Identifier: Apache-2.0
// The RAA38S6 on an asynchronous line, as a host asks it: by a pulse on CLK, or by its number on a bus.
#pragma once

#include <algorithm>

#include "absenc/protocol/author/confirm.hpp"
#include "absenc/protocol/raa38/serial/frame.hpp"
#include "absenc/protocol/raa38/serial/timing.hpp"

namespace absenc::raa38::serial {

struct Protocol {
  using Format = serial::Format;
  using Request = serial::Request;
  using Reply = Position;
  static constexpr std::size_t longest_reply = frame_capacity;

  static constexpr author::Wire wire(const Format& format) {
    return {.answer_limit = format.acquisition > Time{} ? format.acquisition + answer_slack : answer_limit,
            .gap_limit = std::max(format.transmission, gap_limit),
            .patience = patience};
  }
  static constexpr author::Manner manner(const Format&, const Request& request) {
    switch (request.kind) {
      case Request::Kind::trigger:
        return {.pulse = trigger_width, .line = Line::trigger};
      case Request::Kind::clear:
        return {.answered = false, .pulse = clear_width, .line = Line::clear};
      default:
        return {.answered = request.kind == Request::Kind::read};
    }
  }
  static constexpr RequestBytes encode(const Format&, const Request& request) { return encode_request(request); }
  static constexpr Result<Request> decode_request(const Format&, Bytes bytes) { return serial::decode_request(bytes); }
  static constexpr std::size_t expected(const Format& format, const Request&, Bytes) { return format.frame_bytes(); }
  static constexpr Result<Position> decode(const Format& format, const Request& request, Bytes bytes) {
    if (bytes.empty()) return Error::timeout;
    if (request.kind == Request::Kind::zero_clear) return Error::unexpected_reply;  // nothing answers it
    return decode_position(format, bytes, request.kind == Request::Kind::read ? request.unit : anybody);
  }
  static constexpr Reading reading(const Format& format, const Request&, const Position& position) {
    return to_reading(format, position, {}, {});
  }
  /// The sum does not see swapped bytes; a speed that no shaft has shows them.
  static constexpr bool needs_another(const Format& format, const Position&) { return format.maximum_rpm != 0; }
  static constexpr Error agree(const Format& format, const Position& first, const Position& second, Time between) {
    const bool possible = is_possible(format, first.singleturn, second.singleturn, between);
    return possible ? Error::none : Error::cross_check_failed;
  }
};

/// What asks this encoder for a position.
[[nodiscard]] constexpr Request position_request(const Format& format) {
  return {format.mode == Mode::bus ? Request::Kind::read : Request::Kind::trigger, format.unit};
}

/// One position of an encoder that is asked.
using ReadPosition = author::ReadConfirmed<Protocol>;

}  // namespace absenc::raa38::serial
