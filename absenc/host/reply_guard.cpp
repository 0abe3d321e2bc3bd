// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/reply_guard.hpp"

#include <algorithm>

namespace absenc::host {

namespace {

using namespace std::chrono_literals;

constexpr int quiet_limits = 4;         // how many limits a line is quiet before a request is repeated
constexpr Time longest_quiet = 2500ms;  // no reply that is later has been seen but on a line that is always late
constexpr Time stall_quiet = 500ms;     // how long a line that stalled is quiet before what it held back is lost
constexpr Time longest_way = 10s;       // what has not come by then is lost
constexpr Time noise_limit = 100ms;     // no reply goes on for so long
constexpr Time tick{1};

}  // namespace

template <class Item>
void ReplyGuard<Item>::attach(Machine<Item>& inner, const Unit& unit, const Options& options, bool may_repeat) {
  close();
  inner_ = &inner;
  owed_.judge_by(unit, options);
  may_repeat_ = may_repeat;
  tell_sent_ = tell_error_ = tell_reply_ = tell_silence_ = false;
}

// ---- What is owed

template <class Item>
void ReplyGuard<Item>::close() {
  const bool looked_after = phase_ == Phase::asking || phase_ == Phase::holding;  // and the conversation left
  if (looked_after || (open_ && (!heard_ || doubtful_))) owed_.add(request_, expect_, sent_at_);
  open_ = false;
  phase_ = Phase::passing;
}

template <class Item>
bool ReplyGuard<Item>::is_request(const Step<Item>& step) const {
  using Kind = typename Step<Item>::Kind;
  if (step.kind == Kind::pulse) return step.wire == ExtraWire::trigger;
  if (step.kind != Kind::transfer || step.out.empty() || step.out.size() > Request::capacity()) return false;
  return owed_.is_answered(step.out);
}

template <class Item>
Time ReplyGuard<Item>::quiet_time() const {
  return std::min(std::max(quiet_limits * std::max(limit_, pending_.answer), lateness_ * 3 / 2), longest_wait());
}

template <class Item>
Time ReplyGuard<Item>::longest_wait() const {
  return std::clamp(lateness_ * 3 / 2, longest_quiet, longest_way);
}

// ---- Steps

template <class Item>
Step<Item> ReplyGuard<Item>::next(Time now) {
  for (;;) {
    switch (phase_) {
      case Phase::passing:
        return pass(now);
      case Phase::before:
        if (now < until_) return {.at = until_, .gap = pending_.gap};
        // Not into what is still coming, unless it never ends: then the conversation finds out.
        if (noise_end_ == never) noise_end_ = now + noise_limit;
        if (!is_can && heard_at_ + pending_.gap > now && now < noise_end_) {
          until_ = heard_at_ + pending_.gap;
          break;
        }
        return send(now);
      case Phase::asking:
        if (now < until_) {
          const std::size_t due = pending_.expect - std::min(pending_.expect, reply_.size());
          return {.expect = due, .at = until_, .answer = pending_.answer, .gap = pending_.gap};
        }
        // Something goes on that is no reply: on CAN that of others.
        reply_.clear();
        damaged_ = !is_can;
        conclude_asking(true);
        break;
      case Phase::holding:
        if (now < until_) return {.at = until_, .gap = pending_.gap};
        return end_holding(now);
    }
  }
}

// What the conversation wants goes on where it was made: a step is not copied on each of its ways.
template <class Item>
Step<Item> ReplyGuard<Item>::pass(Time now) {
  Step<Item> step = next_passing(now);
  const bool asks = is_request(step);
  if (asks || step.kind == Step<Item>::Kind::done) close();
  if (asks) {
    begin(step, now);
    step = next(now);
  }
  return step;
}

// After each event that is told, the conversation is asked for its next step.
template <class Item>
Step<Item> ReplyGuard<Item>::next_passing(Time now) {
  while (deliver()) {
    const Step<Item> step = inner_->next(now);
    if (step.kind != Step<Item>::Kind::wait) return step;
  }
  return inner_->next(now);
}

template <class Item>
bool ReplyGuard<Item>::deliver() {
  using Kind = typename Event<Item>::Kind;
  const auto due = [](bool& tell) { return tell && !(tell = false); };
  if (due(tell_sent_)) {
    inner_->feed({.kind = Kind::sent, .at = sent_at_});
  } else if (due(tell_error_)) {
    inner_->feed({.kind = Kind::line_error, .at = received_at_});
  } else if (due(tell_reply_)) {
    inner_->feed({.kind = Kind::received, .at = received_at_, .items = reply_});
  } else if (due(tell_silence_)) {
    inner_->feed({.kind = Kind::silence, .at = std::max(sent_at_, received_at_)});
  } else {
    return false;
  }
  return true;
}

template <class Item>
void ReplyGuard<Item>::begin(const Step<Item>& request, Time now) {
  tell_sent_ = tell_error_ = tell_reply_ = tell_silence_ = false;
  pending_ = request;
  reply_.clear();
  owed_.forget(now - longest_way);
  heard_at_ = now - request.gap;
  noise_end_ = never;
  latest_ = std::max(now, request.at) + 4 * longest_wait();
  // A pause before the request is listened to as well; a short one the port keeps more exactly than its timer.
  until_ = request.at > now + 1ms ? request.at : now + tick;
  if (owed_.full()) {  // no more can be kept apart: a silence ends them all
    until_ = std::max(until_, sent_at_ + quiet_time());
  } else if (const Owed* owed = owed_.find(request.out)) {
    // Who has not answered twice, on a line where nothing came late, is not there.
    const bool absent = lateness_ == Time{} && owed->count() > 1;
    const Time quiet = lateness_ == Time{} ? quiet_time() / 2 : quiet_time();
    if (!absent) until_ = std::max(until_, owed->newest() + quiet);
  }
  phase_ = Phase::before;
}

template <class Item>
Step<Item> ReplyGuard<Item>::send(Time now) {
  request_.clear();
  request_.append(pending_.out);
  expect_ = pending_.expect;
  asked_ = true;
  if (owed_.full()) owed_.clear();
  owed_.sent_again(request_, longest_wait());
  reply_.clear();
  stranger_.clear();
  damaged_ = false;
  sent_at_ = received_at_ = now;
  if (owed_.empty()) {
    phase_ = Phase::passing;
    open_ = true;
    heard_ = doubtful_ = false;
  } else {
    phase_ = Phase::asking;
    until_ = never;
  }
  return pending_;
}

// ---- Events

template <class Item>
void ReplyGuard<Item>::feed(const Event<Item>& event) {
  switch (phase_) {
    case Phase::passing:
      return feed_passing(event);
    case Phase::asking:
      return feed_asking(event);
    case Phase::before:
    case Phase::holding:
      if (event.kind == Event<Item>::Kind::received) take_late(event.items, event.at);
      if (event.kind == Event<Item>::Kind::silence) pause_late(event.at);
      return;
  }
}

template <class Item>
void ReplyGuard<Item>::feed_passing(const Event<Item>& event) {
  using Kind = typename Event<Item>::Kind;
  if (event.kind == Kind::sent) sent_at_ = event.at;
  if (event.kind == Kind::received && open_) heard_ = heard_ || owed_.concerns(request_, event.items);
  if constexpr (is_can) {
    // Whoever only listens is not answered: what comes of that was owed to others.
    if (event.kind == Kind::received && !open_ && !owed_.empty()) {
      if (Owed* const owed = owed_.owed_to(event.items)) return count_late(owed, event.at);
    }
  }
  if (event.kind == Kind::silence && open_ && !heard_) limit_ = std::max(limit_, event.at - sent_at_);
  inner_->feed(event);
}

template <class Item>
void ReplyGuard<Item>::feed_asking(const Event<Item>& event) {
  using Kind = typename Event<Item>::Kind;
  switch (event.kind) {
    case Kind::sent:
      sent_at_ = event.at;
      if (reply_.empty()) received_at_ = event.at;
      until_ = sent_at_ + quiet_time() + (is_can ? Time{} : longest_wait());
      break;
    case Kind::received:
      take(event.items, event.at);
      break;
    case Kind::line_error:
      damaged_ = true;
      break;
    case Kind::silence:
      if (reply_.empty()) limit_ = std::max(limit_, event.at - sent_at_);
      conclude_asking(true);
      break;
    default:
      break;
  }
}

template <class Item>
void ReplyGuard<Item>::take(std::span<const Item> items, Time at) {
  for (const Item& item : items) {
    if constexpr (is_can) {
      const std::span<const Item> one(&item, 1);
      if (!owed_.concerns(request_, one) && owed_.owed_to(one) == nullptr) {
        keep_stranger(item);
        continue;
      }
    }
    if (reply_.empty()) first_at_ = at;
    reply_.push_back(item);
  }
  if (!is_can) strip_late(at);
  if (reply_.empty()) return;
  received_at_ = at;
  if (!is_can && at - first_at_ >= noise_limit) return conclude_noise();
  // Where the length is not known silence ends the reply: some begin with what is one already.
  const std::size_t expected = is_can ? 1 : pending_.expect;
  if (expected == 0 || reply_.size() < expected) return;
  if (owed_.is_reply(request_, reply_) || owed_.owed_to(reply_) != nullptr) conclude_asking(false);
}

template <class Item>
void ReplyGuard<Item>::keep_stranger(const Item& item) {
  if constexpr (is_can) {
    CanFrame plain = item;
    plain.extended = false;
    if (item.extended && owed_.concerns(request_, std::span(&plain, 1))) stranger_.push_back(item);
  }
}

// What begins with the reply to another request is that, and what is behind it may be this one's.
template <class Item>
void ReplyGuard<Item>::strip_late(Time at) {
  for (std::size_t i = 0; i < owed_.size();) {
    const std::size_t size = owed_[i].expect;
    const std::span<const Item> start = reply_.view().first(std::min(size, reply_.size()));
    if (size == 0 || start.size() < size || !owed_.is_reply(owed_[i].request, start) ||
        owed_.is_reply(request_, start)) {
      ++i;
      continue;
    }
    count_late(&owed_[i], at);
    drop_first(reply_, size);
    first_at_ = at;
    i = 0;
  }
}

template <class Item>
void ReplyGuard<Item>::count_late(Owed* owed, Time at) {
  Time sent_at = sent_at_;
  if (owed != nullptr) {
    sent_at = owed->sent_at.empty() ? owed->lost_last : owed->sent_at[0];
    // The first late reply of several that are owed may be to any of them: the next one tells. On CAN it may also have
    // been sent unsolicited.
    if (!is_can && lateness_ == Time{}) sent_at = owed->newest();
  }
  lateness_ = std::max(lateness_, std::min(at - sent_at, longest_way));
  // One too many, where nothing was late yet, is more likely to have come twice.
  if (owed == nullptr && late_ == 0) return;
  ++late_;
  if (phase_ == Phase::holding) lateness_ = std::max(lateness_, suspected_);  // another one comes: it was
  latest_reply_ = std::max(latest_reply_, lateness_);
  if (owed != nullptr) owed_.came(*owed);
}

template <class Item>
void ReplyGuard<Item>::conclude_asking(bool silent) {
  if (!reply_.empty()) {
    if (const Owed* owed = owed_.owed_to(reply_)) {
      suspected_ = first_at_ - owed->oldest();
      until_ = std::min(sent_at_ + holding_time(), latest_);
      if (may_repeat_) until_ = std::max(until_, received_at_ + owed_.pause_after(request_));
      reply_.clear();
      phase_ = Phase::holding;
      return;
    }
  }
  phase_ = Phase::passing;
  open_ = true;
  heard_ = !reply_.empty();
  if (!heard_) reply_ = stranger_;
  tell_sent_ = true;
  tell_error_ = damaged_;
  tell_reply_ = !reply_.empty();
  tell_silence_ = silent || !heard_;
  doubtful_ = !(heard_ && !damaged_ && owed_.is_reply(request_, reply_));
  if (!doubtful_) owed_.clear();  // the line keeps the order: whatever was to come before this has come, or is lost
}

// A reply that was late by `suspected_` is followed by the next at the distance of their requests, if the line is
// always late by so much. Where that time passes in silence, and nothing was nearly so late before, the line had
// stalled, and the requests that it held back are lost. A CAN bus holds nothing back.
template <class Item>
Time ReplyGuard<Item>::holding_time() const {
  const Time always_late = std::clamp(suspected_ * 5 / 4, quiet_time(), longest_wait());
  if (is_can || lateness_ * 2 > suspected_) return always_late;
  const Time next_due = received_at_ - sent_at_ + owed_.widest(sent_at_) * 5 / 4;
  return std::min(always_late, std::max({next_due, quiet_time(), stall_quiet}));
}

// On a line that is never silent nothing tells whose a reply is: the conversation, which is to take none of what came,
// finds out in its own time.
template <class Item>
void ReplyGuard<Item>::conclude_noise() {
  phase_ = Phase::passing;
  reply_.clear();
  tell_sent_ = tell_error_ = true;
  open_ = heard_ = doubtful_ = true;
}

// Where the length of a reply is known, the last ones that could be it are looked at: noise may come before them.
template <class Item>
void ReplyGuard<Item>::take_late(std::span<const Item> items, Time at) {
  heard_at_ = at;
  for (const Item& item : items) {
    if (reply_.size() == Reply::capacity()) drop_first(reply_);
    reply_.push_back(item);
    std::size_t i = 0;
    while (i < owed_.size() && !ends_with_reply(owed_[i].request, owed_[i].expect)) ++i;
    if (i < owed_.size()) {
      end_late(&owed_[i], at);
    } else if (!is_can && asked_ && ends_with_reply(request_, expect_)) {
      end_late(nullptr,
               at);  // one too many: what was taken for the reply to the last request may have been another one's
    }
  }
}

// Elsewhere silence ends it.
template <class Item>
void ReplyGuard<Item>::pause_late(Time at) {
  if (reply_.empty()) return;
  if (Owed* const owed = owed_.owed_to(reply_)) {
    end_late(owed, at);
  } else if (!is_can && asked_ && owed_.is_reply(request_, reply_)) {
    end_late(nullptr, at);
  }
  reply_.clear();
}

template <class Item>
bool ReplyGuard<Item>::ends_with_reply(std::span<const Item> request, std::size_t expect) const {
  const std::size_t size = is_can ? 1 : expect;
  return size != 0 && reply_.size() >= size && owed_.is_reply(request, reply_.view().last(size));
}

template <class Item>
void ReplyGuard<Item>::end_late(Owed* owed, Time at) {
  reply_.clear();
  count_late(owed, at);
  if (phase_ == Phase::before) {
    if (owed == nullptr) owed_.add(request_, expect_, sent_at_);
    if (owed_.empty()) {
      until_ = std::max(at + pending_.gap, pending_.at);
      return;
    }
  }
  // On CAN it may also have been sent unsolicited.
  if (!is_can) until_ = std::min(std::max(until_, at + quiet_time()), latest_);
}

template <class Item>
Step<Item> ReplyGuard<Item>::end_holding(Time now) {
  owed_.clear();
  lateness_ -= lateness_ / 16;
  if (may_repeat_) return send(now);
  phase_ = Phase::passing;
  reply_.clear();
  received_at_ = sent_at_;
  tell_sent_ = tell_silence_ = true;
  open_ = false;
  return next(now);
}

template class ReplyGuard<std::uint8_t>;
template class ReplyGuard<CanFrame>;

}  // namespace absenc::host
