// SPDX-License-Identifier: Apache-2.0
// A conversation that reads the position of an encoder with Nikon's A-format; it uses no port, clock, heap or texts.
#pragma once

#include <new>

#include "absenc/protocol/nikon/protocol.hpp"

namespace absenc::nikon {

/// Conversation that sends a request for a position, and if the reply's status is not 0, a request for the alarms (CC
/// 3).
class ReadPosition : public author::HostOf<Protocol> {
 public:
  /// Creates a conversation that sends `request`, which asks for a position, to an encoder of this format.
  explicit ReadPosition(const Format& format, const Request& request) : HostOf(format), position_request_(request) {
    author::Manner manner = Protocol::manner(format, request);
    manner.repeats = 0;
    ask(request, manner);
  }
  /// Creates a conversation that reads position and turns of the encoder with the address of this format.
  explicit ReadPosition(const Format& format) : ReadPosition(format, {.address = format.address}) {}

  [[nodiscard]] const Reading* reading() const final { return has_reading_ ? &reading_ : nullptr; }
  /// Returns the request for the position, even if the conversation sent a request for the alarms after it.
  [[nodiscard]] const Request& request() const { return position_request_; }
  /// Returns the valid reply to the request for the position; an empty reply if there was none.
  [[nodiscard]] const Reply& last() const { return reply_; }

 private:
  void concluded(Error error) final {
    if (error != Error::none) return finish(error);
    if (asks_for_alarms_) {
      reply_.alarms_read = alarms_in(Code::alarms, HostOf::last().data);
      judge(reading_, *reply_.alarms_read);
    } else {
      reply_ = HostOf::last();
      new (&reading_) Reading(last_reading());  // the reading is constructed in place, because a copy costs time
      asks_for_alarms_ = has_position() && reading_.alarms_reported == 0 && reply_.count == 1;
      if (asks_for_alarms_) return ask({.code = Code::alarms, .address = reply_.address}, author::Manner{});
    }
    has_reading_ = has_position();
    finish(Error::none);
  }
  [[nodiscard]] bool has_position() const { return reading_.singleturn_bits + reading_.multiturn_bits != 0; }

  Request position_request_;
  bool asks_for_alarms_ = false;
  bool has_reading_ = false;
  Reply reply_{};
  Reading reading_{};
};

}  // namespace absenc::nikon
