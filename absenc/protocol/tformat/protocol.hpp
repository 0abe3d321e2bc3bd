// SPDX-License-Identifier: Apache-2.0
// The T-format as the engine and the virtual encoder use it: frame.hpp with timing.hpp.
#pragma once

#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/line.hpp"
#include "absenc/protocol/tformat/frame.hpp"
#include "absenc/protocol/tformat/timing.hpp"

namespace absenc::tformat {

struct Protocol {
  using Format = tformat::Format;
  using Request = tformat::Request;
  using Reply = tformat::Reply;
  static constexpr std::size_t longest_reply = reply_capacity;

  static constexpr author::Wire wire(const Format&) { return {.answer_limit = answer_limit, .gap_limit = gap_limit}; }
  /// What reads or selects a page is repeated, resets and writes never. A page change that was not answered well may be
  /// going on all the same, and must not be disturbed.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    if (selects_page(request)) return {.attempts = 3, .pause = memory_time, .hold = memory_time};
    return {.attempts = request.id == DataId::write_memory || is_reset(request.id) ? 1u : 3u};
  }
  static constexpr RequestBytes encode(const Format&, const Request& request) { return encode_request(request); }
  static constexpr std::size_t expected(const Format&, const Request& request, Bytes so_far) {
    return expected_length(request.id, so_far);
  }
  static constexpr Result<Reply> decode(const Format& format, const Request& request, Bytes bytes) {
    if (bytes.empty()) return Error::timeout;
    return decode_reply(format, request, bytes);
  }
  /// A refusal may be followed by the same request at once. After anything else that is wrong more may be coming, and
  /// sending while the encoder sends can destroy its driver (11).
  static constexpr bool is_whole(Error error) { return error == Error::request_rejected; }
  static constexpr Reading reading(const Format& format, const Request&, const Reply& reply) {
    return to_reading(format, reply);
  }

  static constexpr Result<Request> decode_request(const Format&, Bytes bytes) { return tformat::decode_request(bytes); }
  static constexpr std::size_t request_size(Bytes begin) {
    const std::optional<DataId> id = data_id(begin[0]);
    return id && begin[0] == control_field(*id) ? request_length(*id) : 0;
  }
  static constexpr std::size_t reply_size(const Format&, const Request& request) { return reply_length(request.id); }
  static constexpr author::DeviceTimes device_times(const Format&) {
    const Time character = line_settings.character();
    return {character, answer_time, start_up_with_battery, character};  // a missing start bit ends a frame (9.2)
  }
};

}  // namespace absenc::tformat
