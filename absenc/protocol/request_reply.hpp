// SPDX-License-Identifier: Apache-2.0
// Host side of a line on which one request at a time is answered by one reply: how far the present one is.
#pragma once

#include <cstdint>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/noise.hpp"

namespace absenc {

/// The unit sends the request, says what a whole reply is and what becomes of it. On a line that is never silent an
/// exchange ends all the same: `patience` after the first byte that came.
class RequestReply : public Conversation<std::uint8_t> {
 public:
  void feed(const Event<std::uint8_t>& event) final {
    using Kind = Event<std::uint8_t>::Kind;
    switch (event.kind) {
      case Kind::sent:
        sent_at_ = received_at_ = event.at;
        if (state_ == State::sending) state_ = disturbed_ ? State::settling : State::receiving;
        break;
      case Kind::received: {
        if (state_ == State::ending || state_ == State::done) break;
        received_at_ = event.at;
        const State before = state_;
        if (before != State::receiving && before != State::settling) disturbed_ = true;
        noise_.heard(event.at);
        received(event.items);
        end_noise(before);
        break;
      }
      case Kind::line_error:
        disturbed_ = true;
        noise_.heard(event.at);
        if (state_ == State::receiving) state_ = State::settling;
        end_noise(state_);
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

  explicit RequestReply(Time patience = noise_limit) : noise_(patience) {}
  ~RequestReply() = default;

  /// Bytes came, of the reply only while `receiving`.
  virtual void received(Bytes bytes) = 0;
  /// The line is silent, without a reply that was taken; or `is_noisy`, when asking once more is of no use.
  virtual void conclude() = 0;

  /// To be called when the request is handed out.
  void begin_request() {
    state_ = State::sending;
    disturbed_ = false;
    noise_.clear();
  }
  /// For units that listen before they hand a request out: from here on it counts anew.
  void clear_noise() { noise_.clear(); }

  [[nodiscard]] Time sent_at() const { return sent_at_; }
  [[nodiscard]] Time received_at() const { return received_at_; }
  /// Whether the last exchange was given up because the line is never silent.
  [[nodiscard]] bool is_noisy() const { return noise_.is_endless(); }
  /// What to say about it; empty when it was not.
  [[nodiscard]] Explanation noise_explanation() const { return noise_.explanation(); }

  State state_ = State::done;
  bool disturbed_ = false;  // something came before the request was out, or a damaged character
  Time sent_at_{};          // end of the last request
  Time received_at_{};      // of the last bytes of its reply; before them sent_at_

 private:
  void end_noise(State before) {
    const bool waits = state_ == State::receiving || state_ == State::settling;
    const bool listens = state_ == State::ready && before == State::ready;
    if (!waits && !listens && state_ != State::sending) return noise_.clear();  // the reply was taken
    if (is_noisy() && state_ != State::sending) conclude();
  }

  Noise noise_;
};

}  // namespace absenc
