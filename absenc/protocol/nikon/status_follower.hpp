// SPDX-License-Identifier: Apache-2.0
// Combines, in a capture, a reply whose status is not 0 with the alarms that the host read directly after it.
#pragma once

#include <cstdint>
#include <utility>

#include "absenc/protocol/nikon/protocol.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::nikon {

/// Composes two exchanges of a capture: a position with a status other than 0, and the alarms that the host then reads.
class StatusFollower final : public Follower {
 public:
  /// Creates a follower for encoders with this format.
  explicit StatusFollower(const Format& format) : format_(format) {}

  void follow(std::uint64_t number, Bytes request, Bytes reply) override {
    complete_ = !request_.empty() && number == first_ + 1 && add_alarms(request, reply);
    if (complete_) return;
    lose();
    if (!is_open(request, reply)) return;
    request_.append(request);
    reply_.append(reply);
    first_ = number;
  }
  void lose() override {
    request_.clear();
    reply_.clear();
    complete_ = false;
  }
  bool take(Composed& one) override {
    if (!std::exchange(complete_, false)) return false;
    one = {.request = request_, .reply = reply_, .first = first_};
    return true;
  }

 private:
  // Returns whether the exchange has a position or turns, but leaves open which alarms are raised.
  [[nodiscard]] bool is_open(Bytes request, Bytes reply) const {
    const Result<Request> asked = decode_request(format_, request);
    if (!asked) return false;
    const Result<Reply> answered = decode_reply(format_, *asked, reply);
    if (!answered) return false;
    const Reading reading = to_reading(format_, asked->code, *answered);
    return reading.singleturn_bits + reading.multiturn_bits != 0 && reading.alarms_reported == 0;
  }
  // Adds an exchange to the stored one. Returns true if the added exchange reads the alarms of the same encoder,
  // otherwise false.
  bool add_alarms(Bytes request, Bytes reply) {
    if (!request_.append(request) || !reply_.append(reply)) return false;
    const Result<Request> both = decode_captured(format_, request_);
    return both && both->with_status && decode_reply(format_, *both, reply_);
  }

  Format format_;
  ByteBuffer<2 * frame_bytes> request_;
  ByteBuffer<longest_one + reply_length(Code::alarms)> reply_;
  std::uint64_t first_ = 0;  // number of the exchange with the position
  bool complete_ = false;    // whether both the position and the alarms were found
};

}  // namespace absenc::nikon
