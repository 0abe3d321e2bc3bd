// SPDX-License-Identifier: Apache-2.0
// Connects a procedure that sends BiSS control frames with the line.
#pragma once

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/biss/control.hpp"
#include "absenc/protocol/biss/host.hpp"

namespace absenc::biss {

/// A conversation that reads positions while a procedure exchanges control frames bit by bit.
template <class F>
class ControlDialog : public author::ClockedHostOf<ProtocolOf<F>>, public author::Routine {
  using Base = author::ClockedHostOf<ProtocolOf<F>>;

 public:
  /// C++ type of a decoded position frame.
  using Reply = typename ProtocolOf<F>::Reply;

  /// Returns an awaitable that clocks the next frame: `co_await dialog.frame()`.
  [[nodiscard]] auto frame() {
    struct Frame {
      ControlDialog& dialog;
      [[nodiscard]] bool await_ready() const { return false; }
      void await_suspend(std::coroutine_handle<>) { dialog.go_on(); }
      Result<Reply> await_resume() const { return dialog.last_; }
    };
    return Frame{*this};
  }
  /// Sets the CDM bit that the host sends after the frame that was received last.
  void set_cdm(bool cdm) { cdm_ = cdm; }
  /// Returns the number of received frames, except a stuck frame after which the host sent the start sequence.
  [[nodiscard]] std::uint32_t frames() const { return frames_; }
  /// Returns the number of received frames that had an error.
  [[nodiscard]] std::uint32_t bad_frames() const { return bad_frames_; }
  /// Returns the time at which the last frame was received.
  [[nodiscard]] Time now() const { return this->received_at(); }
  [[nodiscard]] std::string_view detail() const override { return outcome_.detail; }
  [[nodiscard]] std::string_view advice() const override { return outcome_.advice; }
  /// Returns whether the texts of the outcome stand alone, without the unit's explanation of the last reply.
  [[nodiscard]] bool is_alone() const { return outcome_.alone; }
  [[nodiscard]] ChangeSent change_sent() const final { return this->change(); }
  [[nodiscard]] std::string_view change_note() const final { return this->noted(); }
  [[nodiscard]] Reading carried() const final { return has_position_ ? this->position() : Reading{}; }
  /// Makes the dialog accept frames without process data; the CDS of such frames is valid.
  void accept_empty_frames() { accepts_empty_ = true; }

 protected:
  /// Creates the conversation; the coroutines of the procedure are stored in `arena`.
  ControlDialog(const F& format, std::span<std::byte> arena) : Base(format, author::later), Routine(arena) {}
  ~ControlDialog() = default;

 private:
  // Returns sequence_mismatch if two known life counters do not follow each other.
  [[nodiscard]] Error check_life_counter(const Reply& reply) {
    const int now = life_counter_of(this->format(), reply);
    const int before = std::exchange(life_counter_, now);
    if (now < 0 || before < 0) return Error::none;
    const auto follows = static_cast<int>((static_cast<unsigned>(before) + 1) & low_mask(life_counter_bits));
    return now == follows ? Error::none : Error::sequence_mismatch;
  }
  void go_on() {
    const F& format = this->format();
    this->clock(extended_ ? ProtocolOf<F>::all_clocks(format) : ProtocolOf<F>::clocks(format), cdm_);
  }
  void clocked(BitView samples) final {
    has_position_ = false;
    if (start_.was_given()) return go_on();
    last_ = detail::decoded(this->format(), samples, Cds::any);
    if (start_.is_due(last_.error())) return this->clock(start_pulses);
    ++frames_;
    if (!extended_ && ended_early(last_.error(), samples)) extended_ = true;
    if (accepts_empty_ && last_.error() == Error::bad_checksum && accept_empty(samples)) return resume();
    if (last_) {
      const unsigned head = last_->delay_bits + last_->ack_bits;
      const unsigned expected = head_bits(this->format(), this->format().latency, this->format().period());
      // `is_again` is called for every decoded frame, because the delay of the previous frame confirms a late one.
      const bool again = late_.is_again(head);
      if (head > expected && !again) last_ = Error::truncated;
    }
    if (last_) {
      const Error error = check_life_counter(*last_);
      if (error != Error::none) last_ = error;
    } else {
      life_counter_ = -1;
    }
    if (last_) {
      this->keep(*last_);
      has_position_ = true;
    } else {
      ++bad_frames_;
    }
    resume();
  }
  [[nodiscard]] bool accept_empty(BitView samples) {
    Reply head;
    if (!is_empty_frame(samples, head)) return false;
    last_ = head;
    life_counter_ = -1;
    return true;
  }
  void ended(const author::Outcome& outcome) final {
    outcome_ = outcome;
    this->finish(outcome.error);
  }

  author::Outcome outcome_{};
  Result<Reply> last_ = Error::timeout;
  LateFrames late_;
  StartSequence start_;
  std::uint32_t frames_ = 0;
  std::uint32_t bad_frames_ = 0;
  int life_counter_ = -1;
  bool cdm_ = false;
  bool extended_ = false;
  bool accepts_empty_ = false;
  bool has_position_ = false;  // whether the last frame had a valid position
};

}  // namespace absenc::biss
