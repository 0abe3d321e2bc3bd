// SPDX-License-Identifier: Apache-2.0
// Combines, in a capture, a position with the error messages and warnings that the host reads directly behind it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "absenc/protocol/endat/protocol.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::endat {

/// Composes four exchanges of a capture: a position, the selection of the operating status, its words 0 and 1.
class AlarmWordsFollower final : public Follower {
 public:
  /// Creates a follower for encoders with this format.
  explicit AlarmWordsFollower(const Format& format) : format_(format) {}

  void follow(std::uint64_t number, Bytes request, Bytes reply) override {
    is_complete_ = false;
    const Result<Request> asked = decode_request({request, 8 * request.size()});
    const BitView bits{reply, 8 * reply.size()};
    if (!asked || !decode_reply(format_, *asked, bits)) return reset();
    if (found_ != 0 && asks_same(*asked, alarm_requests[found_ - 1])) {
      append(request, bits, 1 + parameter_bits + crc_bits);
      is_complete_ = found_ == alarm_requests.size();
      found_ = is_complete_ ? 0 : found_ + 1;
      return;
    }
    reset();
    if (!has_position(asked->code) || has_supplement(asked->code)) return;
    first_ = number;
    found_ = 1;
    append(request, bits, 1 + reply_size(format_, asked->code));
  }
  /// Does nothing: a host repeats a damaged request for a word, and the word still belongs to the position.
  void lose() override {}
  bool take(Composed& one) override {
    if (!std::exchange(is_complete_, false)) return false;
    one = {.request = request_.view(), .reply = reply_.bytes(), .first = first_};
    return true;
  }

 private:
  // Appends a request, and the `size` bits of its reply from the start bit on: behind two clocks in which the line
  // turns, and up to a whole byte.
  void append(Bytes request, const BitView& reply, std::size_t size) {
    static_cast<void>(request_.append(request));
    static_cast<void>(reply_.append(0, turn_bits));
    const std::size_t start = find_start(reply);
    for (std::size_t i = start; i < std::min(start + size, reply.size); ++i) {
      static_cast<void>(reply_.append(reply[i] ? 1 : 0, 1));
    }
    while (reply_.size() % 8 != 0) static_cast<void>(reply_.append(1, 1));
  }
  void reset() {
    found_ = 0;
    request_.clear();
    reply_.clear();
  }

  static constexpr std::size_t longest_position = turn_bits + 1 + 2 + most_bits + crc_bits + 2 * info_bits;

  Format format_;
  ByteBuffer<(command_bits + alarm_requests.size() * access_bits) / 8> request_;
  BitBuffer<(longest_position + 7) / 8 * 8 + alarm_requests.size() * access_bits> reply_;
  std::uint64_t first_ = 0;  // number of the exchange with the position
  std::size_t found_ = 0;    // number of exchanges in `request_`, if they do not make a composed frame yet; else 0
  bool is_complete_ = false;
};

}  // namespace absenc::endat
