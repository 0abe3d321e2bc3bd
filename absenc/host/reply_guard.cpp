// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/reply_guard.hpp"

#include <algorithm>
#include <utility>

namespace absenc::host {

namespace {

using namespace std::chrono_literals;

// Length of the silence that the function `required_silence` demands on the line, in multiples of the longest timeout.
constexpr int silent_timeouts = 4;
// Upper limit of a wait for late replies, unless 3/2 of the time expected from a request to its late reply is longer.
constexpr Time longest_silence = 2500ms;
// Shortest silence after which replies that a stalled line has delayed count as lost.
constexpr Time stall_silence = 500ms;
constexpr Time longest_lateness = 10s;  // a reply that arrives later than this after its request counts as lost
// Items that keep arriving for less than this time are not taken for noise.
constexpr Time least_noise = 100ms;
constexpr Time tick{1};

}  // namespace

template <class Item>
void ReplyGuard<Item>::attach(Machine<Item>& inner, const Unit& unit, const Options& options, bool may_repeat) {
  end_exchange();
  enter_forwarding({});
  inner_ = &inner;
  outstanding_.use(unit, options);
  may_repeat_ = may_repeat;
}

template <class Item>
bool ReplyGuard<Item>::is_request(const Step<Item>& step) const {
  using Kind = typename Step<Item>::Kind;
  if (step.kind == Kind::pulse) return step.wire == ExtraWire::trigger;
  if (step.kind != Kind::transfer || step.out.empty() || step.out.size() > Request::capacity()) return false;
  return outstanding_.is_answered(step.out);
}

template <class Item>
Time ReplyGuard<Item>::required_silence() const {
  const Time timeout = std::max(longest_timeout_, pending_.step.answer);
  return std::min(std::max(silent_timeouts * timeout, expected_lateness_ * 3 / 2), longest_wait());
}

template <class Item>
Time ReplyGuard<Item>::noise_limit() const {
  return std::max(least_noise, static_cast<int>(received_.capacity()) * outstanding_.character());
}

template <class Item>
Time ReplyGuard<Item>::longest_wait() const {
  return std::clamp(expected_lateness_ * 3 / 2, longest_silence, longest_lateness);
}

// ---- Transitions between phases

// Ends the exchange. The last request becomes outstanding if its reply may still arrive.
template <class Item>
void ReplyGuard<Item>::end_exchange() {
  const bool unmatched = phase_ == Phase::matching || phase_ == Phase::listening;
  const bool unanswered =
      phase_ == Phase::forwarding && forwarding_.answerable && (!forwarding_.received || forwarding_.doubtful);
  if (unmatched || unanswered) outstanding_.add(last_.items, last_.expect, last_.sent_at);
  if (phase_ != Phase::forwarding) return enter_forwarding({});
  forwarding_.answerable = false;
}

template <class Item>
void ReplyGuard<Item>::enter_forwarding(const Forwarding& data) {
  phase_ = Phase::forwarding;
  forwarding_ = data;
}

template <class Item>
void ReplyGuard<Item>::enter_delaying(const Step<Item>& request, Time now) {
  phase_ = Phase::delaying;
  received_.clear();
  outstanding_.remove_older(now - longest_lateness);
  pending_ = {.step = request, .deadline = std::max(now, request.at) + 4 * longest_wait()};
  // A request at most 1 ms ahead is left to the port, which keeps the time more exactly than a timer.
  delaying_ = {.until = request.at > now + 1ms ? request.at : now + tick, .received_at = now - request.gap};
  // If the list of outstanding requests is full, the guard waits for silence; `send` then clears the list.
  if (outstanding_.full()) {
    delaying_.until = std::max(delaying_.until, last_.sent_at + required_silence());
  } else if (const Entry* entry = outstanding_.find(request.out)) {
    // An encoder that left the same request unanswered twice is most likely absent.
    const bool absent = expected_lateness_ == Time{} && entry->count() > 1;
    const Time silence = expected_lateness_ == Time{} ? required_silence() / 2 : required_silence();
    if (!absent) delaying_.until = std::max(delaying_.until, entry->newest() + silence);
  }
}

template <class Item>
Step<Item> ReplyGuard<Item>::send(Time now) {
  last_.items.clear();
  last_.items.append(pending_.step.out);
  last_.expect = pending_.step.expect;
  last_.exists = true;
  last_.sent_at = now;
  received_.clear();
  if (outstanding_.full()) outstanding_.clear();
  outstanding_.mark_lost(last_.items, longest_wait());
  if (outstanding_.empty()) {
    enter_forwarding({.answerable = true});
  } else {
    phase_ = Phase::matching;
    matching_ = {.received_at = now};
  }
  return pending_.step;
}

// Enters the phase listening, because the stored reply may be a late one to the request `entry`.
template <class Item>
void ReplyGuard<Item>::enter_listening(const Entry& entry) {
  const Time suspected = matching_.first_at - entry.oldest();
  Time until = std::min(last_.sent_at + listening_time(suspected), pending_.deadline);
  if (may_repeat_) until = std::max(until, matching_.received_at + outstanding_.pause_after(last_.items));
  phase_ = Phase::listening;
  received_.clear();
  listening_ = {.until = until, .suspected = suspected};
}

// Returns how long the phase listening lasts, from the end of the request.
template <class Item>
Time ReplyGuard<Item>::listening_time(Time suspected) const {
  const Time always_late = std::clamp(suspected * 5 / 4, required_silence(), longest_wait());
  if (is_can || expected_lateness_ * 2 > suspected) return always_late;
  const Time next_due = matching_.received_at - last_.sent_at + outstanding_.longest_interval(last_.sent_at) * 5 / 4;
  return std::min(always_late, std::max({next_due, required_silence(), stall_silence}));
}

// ---- Steps

template <class Item>
Step<Item> ReplyGuard<Item>::next(Time now) {
  for (;;) {
    switch (phase_) {
      case Phase::forwarding:
        return forward(now);
      case Phase::delaying:
        if (now < delaying_.until) return {.at = delaying_.until, .gap = pending_.step.gap};
        // The request must not collide with bytes that still arrive, unless they are noise.
        if (!is_can && delaying_.received_at + pending_.step.gap > now) {
          if (delaying_.noise_end == never) delaying_.noise_end = now + noise_limit();
          if (now < delaying_.noise_end) {
            delaying_.until = delaying_.received_at + pending_.step.gap;
            break;
          }
        }
        return send(now);
      case Phase::matching:
        if (now < matching_.until) {
          const std::size_t expected = pending_.step.expect;
          const std::size_t due = expected - std::min(expected, received_.size());
          return {.expect = due, .at = matching_.until, .answer = pending_.step.answer, .gap = pending_.step.gap};
        }
        // The time limit for the reply has passed, so the phase matching ends.
        received_.clear();
        matching_.damaged = !is_can;
        conclude_matching(true);
        break;
      case Phase::listening:
        if (now < listening_.until) return {.at = listening_.until, .gap = pending_.step.gap};
        return end_listening(now);
    }
  }
}

// Returns the conversation's next step. If it is a request, enters the phase delaying and returns its step.
template <class Item>
Step<Item> ReplyGuard<Item>::forward(Time now) {
  Step<Item> step = next_of_conversation(now);
  const bool requests = is_request(step);
  if (requests || step.kind == Step<Item>::Kind::done) end_exchange();
  if (requests) {
    enter_delaying(step, now);
    step = next(now);
  }
  return step;
}

template <class Item>
Step<Item> ReplyGuard<Item>::next_of_conversation(Time now) {
  while (report_event()) {
    const Step<Item> step = inner_->next(now);
    if (step.kind != Step<Item>::Kind::wait) return step;
  }
  return inner_->next(now);
}

template <class Item>
bool ReplyGuard<Item>::report_event() {
  using Kind = typename Event<Item>::Kind;
  Report& report = forwarding_.report;
  if (std::exchange(report.sent, false)) {
    inner_->feed({.kind = Kind::sent, .at = last_.sent_at});
  } else if (std::exchange(report.line_error, false)) {
    inner_->feed({.kind = Kind::line_error, .at = report.received_at});
  } else if (std::exchange(report.reply, false)) {
    inner_->feed({.kind = Kind::received, .at = report.received_at, .items = received_});
  } else if (std::exchange(report.timeout, false)) {
    inner_->feed({.kind = Kind::silence, .at = std::max(last_.sent_at, report.received_at)});
  } else {
    return false;
  }
  return true;
}

template <class Item>
Step<Item> ReplyGuard<Item>::end_listening(Time now) {
  outstanding_.clear();
  expected_lateness_ -= expected_lateness_ / 16;
  if (may_repeat_) return send(now);
  received_.clear();
  enter_forwarding({.report = {.sent = true, .timeout = true, .received_at = last_.sent_at}});
  return next(now);
}

// ---- Events

template <class Item>
void ReplyGuard<Item>::feed(const Event<Item>& event) {
  switch (phase_) {
    case Phase::forwarding:
      return feed_forwarding(event);
    case Phase::matching:
      return feed_matching(event);
    case Phase::delaying:
    case Phase::listening:
      if (event.kind == Event<Item>::Kind::received) drop_items(event.items, event.at);
      if (event.kind == Event<Item>::Kind::silence) drop_at_silence(event.at);
      return;
  }
}

template <class Item>
void ReplyGuard<Item>::feed_forwarding(const Event<Item>& event) {
  using Kind = typename Event<Item>::Kind;
  Forwarding& exchange = forwarding_;
  if (event.kind == Kind::sent) last_.sent_at = event.at;
  if (event.kind == Kind::received && exchange.answerable) {
    exchange.received = exchange.received || outstanding_.may_answer(last_.items, event.items);
  }
  if constexpr (is_can) {
    // No exchange is open now: a frame that answers an outstanding request is taken for its late reply.
    if (event.kind == Kind::received && !exchange.answerable && !outstanding_.empty()) {
      if (Entry* const entry = outstanding_.find_by_reply(event.items)) return count_late(entry, event.at);
    }
  }
  if (event.kind == Kind::silence && exchange.answerable && !exchange.received) {
    longest_timeout_ = std::max(longest_timeout_, event.at - last_.sent_at);
  }
  inner_->feed(event);
}

template <class Item>
void ReplyGuard<Item>::feed_matching(const Event<Item>& event) {
  using Kind = typename Event<Item>::Kind;
  switch (event.kind) {
    case Kind::sent:
      last_.sent_at = event.at;
      if (received_.empty()) matching_.received_at = event.at;
      matching_.until = event.at + required_silence() + (is_can ? Time{} : longest_wait());
      break;
    case Kind::received:
      store(event.items, event.at);
      break;
    case Kind::line_error:
      matching_.damaged = true;
      break;
    case Kind::silence:
      if (received_.empty()) longest_timeout_ = std::max(longest_timeout_, event.at - last_.sent_at);
      conclude_matching(true);
      break;
    default:
      break;
  }
}

// ---- Matching

template <class Item>
void ReplyGuard<Item>::store(Items items, Time at) {
  for (const Item& item : items) {
    if constexpr (is_can) {
      const Items frame(&item, 1);
      if (!outstanding_.may_answer(last_.items, frame) && outstanding_.find_by_reply(frame) == nullptr) {
        keep_foreign(item);
        continue;
      }
    }
    if (received_.empty()) matching_.first_at = at;
    received_.push_back(item);
  }
  if (!is_can) strip_late(at);
  if (received_.empty()) return;
  matching_.received_at = at;
  if (!is_can && at - matching_.first_at >= noise_limit()) return conclude_noise();
  // The first items of a reply of unknown length may look like a complete reply, so they prove nothing.
  const std::size_t expected = is_can ? 1 : pending_.step.expect;
  if (expected == 0 || received_.size() < expected) return;
  const bool complete =
      outstanding_.is_reply(last_.items, received_) || outstanding_.find_by_reply(received_) != nullptr;
  if (complete) conclude_matching(false);
}

template <class Item>
void ReplyGuard<Item>::keep_foreign(const Item& item) {
  if constexpr (is_can) {
    CanFrame plain = item;
    plain.extended = false;
    const bool answers = item.extended && outstanding_.may_answer(last_.items, Items(&plain, 1));
    if (answers) matching_.foreign_frame.push_back(item);
  }
}

template <class Item>
void ReplyGuard<Item>::strip_late(Time at) {
  for (std::size_t i = 0; i < outstanding_.size();) {
    const std::size_t size = outstanding_[i].expect;
    const Items start = received_.view().first(std::min(size, received_.size()));
    if (size == 0 || start.size() < size || !outstanding_.is_reply(outstanding_[i].request, start) ||
        outstanding_.is_reply(last_.items, start)) {
      ++i;
      continue;
    }
    count_late(&outstanding_[i], at);
    drop_first(received_, size);
    matching_.first_at = at;
    i = 0;
  }
}

template <class Item>
void ReplyGuard<Item>::conclude_matching(bool timed_out) {
  const bool received = !received_.empty();
  if (received) {
    if (const Entry* entry = outstanding_.find_by_reply(received_)) return enter_listening(*entry);
  }
  const bool valid = received && !matching_.damaged && outstanding_.is_reply(last_.items, received_);
  // The line keeps the order of replies: after a reply to the last request, those to earlier ones cannot arrive.
  if (valid) outstanding_.clear();
  if (!received) received_.append(matching_.foreign_frame);
  enter_forwarding({.answerable = true,
                    .received = received,
                    .doubtful = !valid,
                    .report = {.sent = true,
                               .line_error = matching_.damaged,
                               .reply = !received_.empty(),
                               .timeout = timed_out || !received,
                               .received_at = matching_.received_at}});
}

// Ends the phase matching without a reply: on a line that is never silent no reply can be matched to a request.
template <class Item>
void ReplyGuard<Item>::conclude_noise() {
  received_.clear();
  enter_forwarding({.answerable = true,
                    .received = true,
                    .doubtful = true,
                    .report = {.sent = true, .line_error = true, .received_at = matching_.received_at}});
}

// ---- Delaying and listening

// Drops items that do not go to the conversation, but stores the last of them to detect late replies.
template <class Item>
void ReplyGuard<Item>::drop_items(Items items, Time at) {
  if (phase_ == Phase::delaying) delaying_.received_at = at;
  for (const Item& item : items) {
    if (received_.size() == received_.capacity()) drop_first(received_);
    received_.push_back(item);
    std::size_t i = 0;
    while (i < outstanding_.size() && !ends_with_reply(outstanding_[i].request, outstanding_[i].expect)) ++i;
    if (i < outstanding_.size()) {
      drop_late_reply(&outstanding_[i], at);
    } else if (!is_can && last_.exists && ends_with_reply(last_.items, last_.expect)) {
      // The line has sent a second reply to the last request: the first may have belonged to an earlier request.
      drop_late_reply(nullptr, at);
    }
  }
}

// Checks the stored items, because a late reply of unknown length ends with silence.
template <class Item>
void ReplyGuard<Item>::drop_at_silence(Time at) {
  if (received_.empty()) return;
  if (Entry* const entry = outstanding_.find_by_reply(received_)) {
    drop_late_reply(entry, at);
  } else if (!is_can && last_.exists && outstanding_.is_reply(last_.items, received_)) {
    drop_late_reply(nullptr, at);
  }
  received_.clear();
}

// Returns whether the last received items are a reply to `request`. Noise may precede the reply.
template <class Item>
bool ReplyGuard<Item>::ends_with_reply(Items request, std::size_t expect) const {
  const std::size_t size = is_can ? 1 : expect;
  return size != 0 && received_.size() >= size && outstanding_.is_reply(request, received_.view().last(size));
}

// Drops a late reply. `entry`: the request that it answers; null: it is a second reply to the last request.
template <class Item>
void ReplyGuard<Item>::drop_late_reply(Entry* entry, Time at) {
  received_.clear();
  count_late(entry, at);
  const bool delaying = phase_ == Phase::delaying;
  if (delaying && entry == nullptr) outstanding_.add(last_.items, last_.expect, last_.sent_at);
  Time& until = delaying ? delaying_.until : listening_.until;
  if (delaying && outstanding_.empty()) {
    until = std::max(at + pending_.step.gap, pending_.step.at);
  } else if (!is_can) {  // on CAN the reply may have been unsolicited, so the wait is not prolonged
    until = std::min(std::max(until, at + required_silence()), pending_.deadline);
  }
}

template <class Item>
void ReplyGuard<Item>::count_late(Entry* entry, Time at) {
  Time sent_at = last_.sent_at;
  if (entry != nullptr) {
    sent_at = entry->sent_at.empty() ? entry->lost_last : entry->sent_at[0];
    // The reply may answer any of several equal requests. The shortest possible time from the request to its late reply
    // is the time since the newest of these requests.
    if (!is_can && expected_lateness_ == Time{}) sent_at = entry->newest();
  }
  expected_lateness_ = std::max(expected_lateness_, std::min(at - sent_at, longest_lateness));
  // If no reply was late so far, a second reply to one request is most likely a duplicate.
  if (entry == nullptr && late_replies_ == 0) return;
  ++late_replies_;
  // Another reply was received while listening, so the stored reply was late.
  if (phase_ == Phase::listening) expected_lateness_ = std::max(expected_lateness_, listening_.suspected);
  greatest_lateness_ = std::max(greatest_lateness_, expected_lateness_);
  if (entry != nullptr) outstanding_.remove_oldest(*entry);
}

template class ReplyGuard<std::uint8_t>;
template class ReplyGuard<CanFrame>;

}  // namespace absenc::host
