// SPDX-License-Identifier: Apache-2.0
// Host side of a line on which one request at a time is answered by one reply: how far the present one is.
#pragma once

#include <cstdint>

#include "absenc/protocol/conversation.hpp"

namespace absenc {

/// The unit sends the request, says what a whole reply is and what becomes of it.
class RequestReply : public Conversation<std::uint8_t> {
 public:
  void feed(const Event<std::uint8_t>& event) final {
    using Kind = Event<std::uint8_t>::Kind;
    switch (event.kind) {
      case Kind::sent:
        sent_at_ = received_at_ = event.at;
        if (state_ == State::sending) state_ = disturbed_ ? State::settling : State::receiving;
        break;
      case Kind::received:
        if (state_ == State::ending || state_ == State::done) break;
        received_at_ = event.at;
        if (state_ != State::receiving && state_ != State::settling) disturbed_ = true;
        received(event.items);
        break;
      case Kind::line_error:
        disturbed_ = true;
        if (state_ == State::receiving) state_ = State::settling;
        break;
      case Kind::silence:
        if (state_ == State::receiving || state_ == State::settling) conclude();
        break;
      default:
        break;
    }
  }

 protected:
  enum class State : std::uint8_t {
    ready,      // the next request is to be sent
    sending,    // until its last bit is out
    receiving,  // the reply is due
    settling,   // something is wrong: until the line is silent
    ending,     // the result is known, but told only after a time the encoder needs
    done,
  };

  ~RequestReply() = default;

  /// Bytes came, of the reply only while `receiving`.
  virtual void received(Bytes bytes) = 0;
  /// The line is silent, without a reply that was taken.
  virtual void conclude() = 0;

  [[nodiscard]] Time sent_at() const { return sent_at_; }
  [[nodiscard]] Time received_at() const { return received_at_; }

  State state_ = State::done;
  bool disturbed_ = false;  // something came before the request was out, or a damaged character
  Time sent_at_{};          // end of the last request
  Time received_at_{};      // of the last bytes of its reply; before them sent_at_
};

}  // namespace absenc
