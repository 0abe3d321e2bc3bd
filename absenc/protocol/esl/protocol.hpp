// SPDX-License-Identifier: Apache-2.0
// ESL as the author's layer takes it: one request, one reply, both with their checks.
#pragma once

#include "absenc/protocol/author/line.hpp"
#include "absenc/protocol/esl/reply.hpp"
#include "absenc/protocol/esl/timing.hpp"

namespace absenc::esl {

[[nodiscard]] constexpr bool selects_page(const Request& request) {
  return request.id == DataId::write_memory && request.memory_address == page_select_address;
}

struct Protocol {
  using Format = Profile;
  using Request = esl::Request;
  using Reply = esl::Reply;
  static constexpr std::size_t longest_reply = reply_capacity;

  static constexpr author::Wire wire(const Profile&) { return {.answer_limit = answer_limit, .gap_limit = gap_limit}; }
  /// A page change that was not answered well may be going on all the same, and so may the reading of an EEPROM byte:
  /// neither a repetition nor whoever comes next may meet it.
  static constexpr author::Manner manner(const Profile&, const Request& request) {
    const Time busy = selects_page(request) ? page_time : is_memory_access(request.id) ? eeprom_read_pause : Time{};
    return {.pause = busy, .hold = busy};
  }
  static constexpr RequestBytes encode(const Profile& profile, const Request& request) {
    return encode_request(profile, request);
  }
  static constexpr std::size_t request_size(const Profile& profile, Bytes begin) {
    const std::optional<DataId> id = data_id(begin[0]);
    if (!id || begin[0] != control_field(profile, address_of(begin[0]), *id)) return 0;
    return request_length(profile, *id);
  }
  static constexpr Result<Request> decode_request(const Profile& profile, Bytes bytes) {
    return esl::decode_request(profile, bytes);
  }
  static constexpr std::size_t reply_size(const Profile&, const Request& request) { return reply_length(request.id); }
  static constexpr std::size_t expected(const Profile&, const Request& request, Bytes) {
    return reply_length(request.id);
  }
  static constexpr Result<Reply> decode(const Profile& profile, const Request& request, Bytes bytes) {
    if (bytes.empty()) return Error::timeout;
    return decode_reply(profile, request, bytes);
  }
  static constexpr Reading reading(const Profile&, const Request&, const Reply& reply) { return to_reading(reply); }
  static constexpr Time latched(const Profile& profile, Time sent_at) { return latch_time(profile, sent_at); }
};

}  // namespace absenc::esl
