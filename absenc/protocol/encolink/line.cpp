// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/line.hpp"

#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {

namespace {

constexpr unsigned frame_attempts = 3;
constexpr unsigned access_attempts = 5;  // each is some hundred frames, all of which must be good

constexpr std::string_view no_channel2 = "without channel 2 (has_ch2=false) there is neither status nor register";
constexpr std::string_view channel2_damaged = "channel 2 is damaged: positions go on, but registers cannot be reached";
constexpr std::string_view stopped_answering = "the encoder stopped answering during a register access";
constexpr std::string_view accesses_ignored = "the encoder ignores register accesses: positions go on";
constexpr std::string_view channel3_nonsense = "channel 3 says neither idle nor busy nor ready";
constexpr std::string_view busy_too_long =
    "the register access was answered with busy for more than 2 s: positions go on";

}  // namespace

Line::Line(const Format& format, std::span<std::byte> arena) : Stream(format, frame_attempts), Routine(arena) {}

// What is waited for is asked for with the next frame, as soon as it can be.
void Line::wait() {
  const bool accesses = until_ == Until::data || until_ == Until::answer;
  if (!format().has_ch2 && (accesses || until_ == Until::cycle)) {
    return end_with({.error = Error::unsupported, .detail = no_channel2});
  }
  if (until_ == Until::cycle) reset_channels();
  if (accesses) submit();
}

// The identity is asked first: an encoder with other registers is left alone.
void Line::submit() {
  if (protocol_version_ == 0) identify();
  if (protocol_version_ == version::aksim4) {
    access_.stop();
    return end_with({.error = Error::unsupported, .detail = not_described});
  }
  attempts_left_ = access_attempts - 1;
  if (!in_step()) reset_channels();
}

// ---- What a frame brings

void Line::on_frame() {
  if (until_ == Until::frame) resume();
  if (!is_over() && emits_frames_) emit();
}

void Line::on_identity(const Identity& identity) {
  identity_ = identity;
  protocol_version_ = identity.protocol_version;
  if (access_.active()) submit();
  if (until_ == Until::identity) resume();
}

void Line::on_cycle(const Result<Cycle>& cycle) {
  last_cycle_ = cycle;
  if (access_.active()) {
    if (!cycle) {
      return try_again(
          {cycle.error(), cycle.error() == Error::cross_check_failed ? channels_disagree : channel2_damaged});
    }
    access_.feed(cycle->channel3);
    return follow_access();
  }
  if (until_ == Until::cycle) resume();
}

void Line::on_damage(Error error) {
  if (access_.active()) try_again({.error = error});
}

void Line::on_failure(Error error) {
  const bool stopped = access_.active() && error == Error::timeout;
  access_.stop();
  const author::Outcome why{error, stopped ? stopped_answering : std::string_view{}};
  if (until_ != Until::answer) return end_with(why);
  answer_ = {Answer::Fate::gone, why};
  resume();
}

// ---- The access

void Line::follow_access() {
  using Phase = RegisterAccess::State;
  switch (access_.state()) {
    case Phase::done:
      if (access_.status() == AccessStatus::ok) return end_access(Answer::Fate::good);
      if (!is_damaged(access_.status()) || attempts_left_ == 0) {
        return end_access(Answer::Fate::refused, {Error::request_rejected, text_of(access_.status())});
      }
      --attempts_left_;  // it was not executed
      access_.restart();
      return reset_channels();
    case Phase::ignored:
      return try_again({Error::timeout, accesses_ignored});
    case Phase::nonsense:
      return try_again({Error::unexpected_reply, channel3_nonsense});
    case Phase::waiting:
      if (access_.busy() && received_at() - access_.asked() > busy_limit) {
        end_access(Answer::Fate::refused, {Error::busy, busy_too_long});
      }
      break;
    default:
      break;
  }
}

// A write that may have been executed is not repeated blindly: whoever wants it reads back first.
void Line::try_again(const author::Outcome& why) {
  const bool blind = !access_.reads() && access_.was_asked();
  if (blind || attempts_left_ == 0) return end_access(Answer::Fate::lost, why);
  --attempts_left_;
  access_.restart();
  reset_channels();
}

void Line::end_access(Answer::Fate fate, const author::Outcome& why) {
  access_.stop();
  if (fate != Answer::Fate::good) lose_step();  // more of the answer may be coming
  if (until_ == Until::data && fate != Answer::Fate::good) return end_with(why);
  answer_ = {fate, why};
  resume();
}

}  // namespace absenc::encolink
