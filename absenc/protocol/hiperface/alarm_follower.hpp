// SPDX-License-Identifier: Apache-2.0
// Finds in a capture the status that a host reads after a position with the error bit: only both together show whether
// the position is valid.
#pragma once

#include <cstdint>

#include "absenc/protocol/hiperface/frame.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::hiperface {

/// Joins a position with the error bit to the status replies of its encoder that follow directly, until a code comes
/// again or is no alarm. Each joined status makes a composed frame.
class AlarmFollower final : public Follower {
 public:
  /// Creates a follower for encoders with this format.
  explicit AlarmFollower(const Format& format) : format_(format) {}

  void follow(std::uint64_t number, Bytes request, Bytes reply) override {
    is_new_ = false;
    const Result<Request> asked = decode_request(format_, request);
    const Result<Reply> got = asked ? decode_reply(format_, *asked, reply) : Result<Reply>(asked.error());
    const bool is_status = got && asked->command == CommandCode::status;
    if (!is_status || request_.empty() || asked->address != request_[0]) {
      is_complete_ = false;
      request_.clear();
      if (!got || asked->command != CommandCode::position || !got->has_error) return;
      request_.append(request);
      reply_.clear();
      reply_.append(reply);
      alarms_ = 0;
      first_ = number;
      return;
    }
    if (is_complete_) return;
    const std::uint32_t alarm = alarm_of(static_cast<std::uint8_t>(got->value));
    is_complete_ = (alarm & ~alarms_) == 0;
    alarms_ |= alarm;
    if (alarms_ == 0) return;  // the error bit may be that of an earlier request
    request_.append(request);
    reply_.append(reply);
    is_new_ = true;
  }
  /// Does nothing: a host repeats a damaged request for the status, and its reply still belongs to the position.
  void lose() override {}
  bool take(Composed& one) override {
    if (!is_new_) return false;
    is_new_ = false;
    one = Composed{.request = request_, .reply = reply_, .first = first_};
    return true;
  }

 private:
  Format format_;
  RequestBytes request_;  // request for the position with those for the status; empty: no position waits for a status
  ReplyBytes reply_;
  std::uint32_t alarms_ = 0;  // alarms that the joined replies name
  std::uint64_t first_ = 0;   // number of the exchange with the position
  bool is_complete_ = false;  // whether a code came again or was no alarm
  bool is_new_ = false;       // whether the last exchange completed a composed frame
};

}  // namespace absenc::hiperface
