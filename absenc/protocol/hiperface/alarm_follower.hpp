// SPDX-License-Identifier: Apache-2.0
// Joins, in a capture, a position whose reply has the error bit with the status that the host reads after it: only both
// together show whether the position is valid.
#pragma once

#include <cstdint>

#include "absenc/protocol/hiperface/frame.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::hiperface {

/// Joins a captured position with the error bit to the status replies of the same encoder that follow it directly. The
/// follower stops when a status code comes again or is no alarm. It makes a new composed frame after each status reply
/// that it has joined.
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
    // a position whose status names no alarm may have the error bit of an earlier request, so no frame is composed
    if (alarms_ == 0) return;
    request_.append(request);
    reply_.append(reply);
    is_new_ = true;
  }
  /// Does nothing when an exchange is lost: a host repeats a damaged request for the status, and its reply still
  /// belongs to the position.
  void lose() override {}
  bool take(Composed& one) override {
    if (!is_new_) return false;
    is_new_ = false;
    one = Composed{.request = request_, .reply = reply_, .first = first_};
    return true;
  }

 private:
  Format format_;
  // bytes of the request for the position and of the joined requests for the status; empty while no captured position
  // has the error bit
  RequestBytes request_;
  ReplyBytes reply_;
  std::uint32_t alarms_ = 0;  // mask of the alarms in the joined status replies
  std::uint64_t first_ = 0;   // number of the exchange with the position
  // whether a status code came again or was no alarm, so that further status replies add no alarms to `alarms_`
  bool is_complete_ = false;
  bool is_new_ = false;  // whether the last exchange has completed a composed frame
};

}  // namespace absenc::hiperface
