// SPDX-License-Identifier: Apache-2.0
// Reads a position in each cycle of a drive, and runs other commands in the time between: one machine for many
// conversations.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "absenc/protocol/conversation.hpp"

namespace absenc::host {

/// A command that a CyclicHost runs beside its positions. It must live until it is done or refused.
template <class Item>
class Service {
 public:
  /// States of a service.
  enum class State : std::uint8_t {
    waiting,  ///< the conversation has not begun
    running,  ///< the conversation has begun
    done,     ///< the conversation has ended, perhaps with an error (Conversation::error)
    refused,  ///< a request does not fit between two positions, and the service may not take cycles
  };

  /// Makes a service of `conversation`, which must outlive it. `takes_cycles`: a request that does not fit between two
  /// positions takes the place of positions, and one that must be alone on the line takes all cycles.
  explicit Service(Conversation<Item>& conversation, bool takes_cycles = false)
      : conversation_(&conversation), takes_cycles_(takes_cycles) {}
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  /// Returns the state of the service.
  [[nodiscard]] State state() const { return state_; }
  /// Returns whether the service is done or refused.
  [[nodiscard]] bool is_over() const { return state_ >= State::done; }
  /// Returns the time that a refused request needs, `never` if its reply has no known length; 0 if the service was not
  /// refused.
  [[nodiscard]] Time needs() const { return needs_; }
  /// Returns the conversation that executes the service's command.
  [[nodiscard]] Conversation<Item>& conversation() const { return *conversation_; }

 private:
  template <class, class>
  friend class CyclicHost;

  Conversation<Item>* conversation_;
  Service* next_ = nullptr;
  Time needs_{};
  State state_ = State::waiting;
  bool takes_cycles_;
};

/// The times that a CyclicHost keeps, and its line.
struct CyclePlan {
  Time period{};  ///< time from one cycle to the next
  /// settings of the line, from which the durations of requests and replies follow; a conversation may set another rate
  LineSettings line{};
  /// longest time from a request to its reply, if shorter than the protocol's limit; 0: the protocol's limit
  Time answer{};
  Time rest{};     ///< shortest silence between a reply and the next request
  Time latency{};  ///< delay of the port, the same as given to the Carrier that runs this machine
  /// Whether the reply to a service's request also carries the position, so that this request replaces that for the
  /// position.
  bool carried = false;
};

/// Result of one cycle.
struct Cycle {
  /// Kinds of cycles.
  enum class Kind : std::uint8_t {
    fresh,     ///< a valid position was read
    invalid,   ///< a good reply, but the encoder marks its position as not valid, or itself as not ready
    missing,   ///< no good reply with a position in this cycle
    repeated,  ///< a service used this cycle, so no position was requested
  };
  Kind kind = Kind::missing;  ///< kind of this cycle
  /// missing: the error of the reading; `busy` if the reading had not ended when the next cycle began
  Error error = Error::none;
  Time begun{};  ///< time at which the cycle began
  /// the last reading; it was read in this cycle if `kind` is fresh or invalid, else in an earlier one
  Reading reading{};
  std::uint32_t stale = 0;  ///< number of cycles since the last cycle that gave a valid position; 0: this cycle did
  /// Returns the time from the latch of `reading` to `at`.
  [[nodiscard]] Time age(Time at) const { return at - reading.latched; }
};

/// Asks for a position in each cycle and runs services in the remaining time: a machine that never ends and emits a
/// Cycle for each period. Call all members in the context in which the machine runs.
///
///     cycle begins      reply          service fits?            next cycle
///     |--- position ----|--- service's request and reply ---|---|--- position ...
///
/// A service's request is sent only if the longest reply that may follow ends before the next cycle. While a
/// service waits between its requests, positions are read. If the plan says `carried`, a service's request takes the
/// place of the position's, and its reply gives both.
///
/// `Item` is the item of the link; `Read` is a callable that returns the Conversation of one position each time that it
/// is called; the conversation is used until the next call. It must end by itself.
template <class Item, class Read>
class CyclicHost final : public Machine<Item> {
 public:
  /// Constructs a host whose first cycle begins at `first`.
  CyclicHost(Read read, const CyclePlan& plan, Time first) : read_(read), plan_(plan), due_(first) {}
  CyclicHost(const CyclicHost&) = delete;
  CyclicHost& operator=(const CyclicHost&) = delete;

  /// Queues a service. It begins when all services queued before it are done or refused.
  void add(Service<Item>& service) {
    service.next_ = nullptr;
    service.state_ = Service<Item>::State::waiting;
    (last_ != nullptr ? last_->next_ : service_) = &service;
    last_ = &service;
  }
  /// Returns the cycle that the last `emit` reported.
  [[nodiscard]] const Cycle& cycle() const { return cycle_; }
  /// Returns how many items were received while neither a reading nor a service expected any.
  [[nodiscard]] std::uint32_t unasked() const { return unasked_; }
  /// Moves the begin of the next cycle to `at`, for drives whose PWM begins the cycles. Call Carrier::wake afterwards.
  /// A cycle that a carried service has begun before its time is not moved.
  void begin_next_at(Time at) { due_ = at; }

  void feed(const Event<Item>& event) override;
  Step<Item> next(Time now) override;

 private:
  using Kind = typename Step<Item>::Kind;
  using State = typename Service<Item>::State;
  static constexpr bool is_can = sizeof(Item) != 1;
  /// Whose exchange is on the line: the reading's, a service's, or none.
  enum class User : std::uint8_t { nobody, position, service };

  void begin_cycle();
  void conclude(Cycle::Kind kind, Error error);
  bool continue_position(Step<Item>& step, Time now);
  void conclude_position(Time now);
  void conclude_with(const Reading& reading);
  void run_service(Time now);
  bool continue_service(Step<Item>& step, Time now);
  void take_service_step(const Step<Item>& step, Time now);
  bool begin_service(Step<Item>& step, Time now);
  void end_service(State state);
  // Stores the bit rate that a conversation sets, because the durations of transfers follow from it.
  void set_rate(const Step<Item>& step) {
    if (step.rate != 0) plan_.line.rate = step.rate;
  }
  void begin_transfer(Step<Item>& step);
  void limit(Step<Item>& step, Time now) const;
  // Returns whether the position of the next cycle may come with the reply to the service's request.
  [[nodiscard]] bool may_carry() const {
    const bool is_alone = is_row_ || step_.holds_line;
    const bool fits = step_.kind != Kind::configure && step_.at < due_ && transfer_time(step_) < plan_.period;
    return plan_.carried && wants_ && !is_alone && fits;
  }
  [[nodiscard]] Time transfer_time(const Step<Item>& step) const;
  [[nodiscard]] Time duration(const Step<Item>& step) const;

  Read read_;
  CyclePlan plan_;
  Time due_;  // begin of the next cycle
  Cycle cycle_{};
  Conversation<Item>* position_ = nullptr;  // conversation that reads the position; null: none runs
  Service<Item>* service_ = nullptr;        // first service of the queue
  Service<Item>* last_ = nullptr;
  // transfer, pulse or change of the bit rate that the service wants to begin next, if there is one
  Step<Item> step_{};
  Time wake_ = Time::min();  // time at which the service wants to continue, if it has no step to begin
  Time rested_at_{};         // earliest time at which a service may send its request
  Time free_since_ = never;  // time at which the last reading ended
  std::uint32_t unasked_ = 0;
  User user_ = User::nobody;
  bool wants_ = false;
  // true: the service keeps the line, so no position may be requested before the service has sent its next request
  bool is_row_ = false;
  bool is_too_long_ = false;  // true: the service's next request did not fit between two positions
  bool takes_ = false;        // the running cycle belongs to the service, so that no position is read
  bool carries_ = false;      // the position of the running cycle comes with the service's reply
  bool is_concluded_ = true;  // true: the result of the running cycle was emitted
  bool emitting_ = false;
  bool in_transfer_ = false;    // true: the transfer that was begun on the line has not ended
  bool ends_by_items_ = false;  // the transfer ends when its items are received: on SPI and clocked links
};

// ---- Events

template <class Item, class Read>
void CyclicHost<Item, Read>::feed(const Event<Item>& event) {
  using Of = typename Event<Item>::Kind;
  if (event.kind == Of::sent || event.kind == Of::received || event.kind == Of::line_error) {
    rested_at_ = event.at + plan_.rest;
  }
  if (event.kind == (ends_by_items_ ? Of::received : Of::sent)) in_transfer_ = false;
  if (user_ == User::nobody) unasked_ += static_cast<std::uint32_t>(event.items.size());
  // The conversations of the position and of the service both get every CAN frame: each recognises the replies to its
  // own requests by their identifier.
  const bool is_for_both = is_can && event.kind == Of::received;
  if (user_ == User::position || (is_for_both && position_ != nullptr)) position_->feed(event);
  const bool is_running = service_ != nullptr && service_->state_ == State::running;
  const bool wakes = is_running && event.kind == Of::timer && !wants_ && event.at >= wake_;
  if (user_ == User::service || wakes || (is_for_both && is_running && !wants_)) {
    service_->conversation_->feed(event);
    if (user_ == User::nobody || user_ == User::position) wake_ = event.at;
  }
}

// ---- Steps

template <class Item, class Read>
Step<Item> CyclicHost<Item, Read>::next(Time now) {
  Step<Item> step;
  for (;;) {
    if (std::exchange(emitting_, false)) return {.kind = Kind::emit};
    if (now >= due_) {
      if (is_concluded_) {
        begin_cycle();
      } else {
        conclude(Cycle::Kind::missing, Error::busy);  // the reading took longer than a cycle
      }
    } else if (user_ == User::service) {
      if (continue_service(step, now)) return step;
    } else if (user_ == User::position) {
      if (continue_position(step, now)) return step;
    } else {
      run_service(now);
      if (user_ == User::service) continue;  // the service only listens, and uses the line now
      if (begin_service(step, now)) return step;
      const Time service_due = service_ == nullptr ? never : wants_ ? step_.at : wake_;
      return {.at = service_due > now ? std::min(due_, service_due) : due_};
    }
  }
}

template <class Item, class Read>
void CyclicHost<Item, Read>::begin_cycle() {
  cycle_.begun = due_;
  due_ += plan_.period;
  is_concluded_ = false;
  if (position_ != nullptr) return;
  carries_ = user_ == User::nobody && may_carry();
  if (carries_) return;
  takes_ = is_row_ || (is_too_long_ && wants_);
  if (takes_ || user_ == User::service) return conclude(Cycle::Kind::repeated, Error::none);
  position_ = &read_();
  user_ = User::position;
}

template <class Item, class Read>
void CyclicHost<Item, Read>::conclude(Cycle::Kind kind, Error error) {
  cycle_.kind = kind;
  cycle_.error = error;
  if (kind == Cycle::Kind::fresh) {
    cycle_.stale = 0;
  } else if (cycle_.stale != ~std::uint32_t{0}) {
    ++cycle_.stale;
  }
  is_concluded_ = emitting_ = true;
}

// ---- Positions

// Sets `step` to the next step of the reading. Returns false if it is no step for the port, but a result or the end.
template <class Item, class Read>
bool CyclicHost<Item, Read>::continue_position(Step<Item>& step, Time now) {
  step = position_->next(now);
  switch (step.kind) {
    case Kind::emit:
      return false;
    case Kind::done:
      conclude_position(now);
      return false;
    case Kind::configure:
      set_rate(step);
      return true;
    case Kind::wait:
      limit(step, now);
      return true;
    case Kind::transfer:
    case Kind::pulse:
      break;
  }
  step.at = std::max(step.at, cycle_.begun);
  begin_transfer(step);
  return true;
}

template <class Item, class Read>
void CyclicHost<Item, Read>::conclude_position(Time now) {
  const Error error = position_->error();
  const Reading* const reading = error == Error::none ? position_->reading() : nullptr;
  position_ = nullptr;
  user_ = User::nobody;
  free_since_ = now;
  reading != nullptr ? conclude_with(*reading) : conclude(Cycle::Kind::missing, error);
}

template <class Item, class Read>
void CyclicHost<Item, Read>::conclude_with(const Reading& reading) {
  cycle_.reading = reading;
  const bool is_valid = reading.ready && reading.singleturn_valid();
  conclude(is_valid ? Cycle::Kind::fresh : Cycle::Kind::invalid, Error::none);
}

// ---- Services

// Asks the conversation of a service that does not use the line now for its next step.
template <class Item, class Read>
void CyclicHost<Item, Read>::run_service(Time now) {
  while (service_ != nullptr && user_ == User::nobody && !wants_ && now >= wake_) {
    service_->state_ = State::running;
    take_service_step(service_->conversation_->next(now), now);
  }
  // The cycle of a carried service begins before its time, because a clock line that is held low in the pause is a bit
  // for the encoder.
  if (user_ == User::nobody && !carries_ && may_carry()) begin_cycle();
}

// Returns whether the service still uses the line; if so, sets `step` to its next step.
template <class Item, class Read>
bool CyclicHost<Item, Read>::continue_service(Step<Item>& step, Time now) {
  step = service_->conversation_->next(now);
  const bool awaits = in_transfer_ || step.expect != 0 || step.answer != Time{} || step.gap != Time{};
  if (step.kind == Kind::wait && (awaits || (step.holds_line && service_->takes_cycles_))) {
    limit(step, now);
    return true;
  }
  user_ = User::nobody;
  if (std::exchange(carries_, false)) {
    const Reading reading = service_->conversation_->carried();
    reading.singleturn_bits != 0 ? conclude_with(reading) : conclude(Cycle::Kind::missing, Error::none);
  }
  take_service_step(step, now);
  return false;
}

template <class Item, class Read>
void CyclicHost<Item, Read>::take_service_step(const Step<Item>& step, Time now) {
  is_too_long_ = takes_ = false;
  switch (step.kind) {
    case Kind::wait:
      if (step.holds_line && !service_->takes_cycles_) return end_service(State::refused);
      wake_ = step.at > now ? step.at : never;
      if (step.holds_line) user_ = User::service;
      return;
    case Kind::emit:
      wake_ = now;
      return;
    case Kind::done:
      return end_service(State::done);
    case Kind::transfer:
    case Kind::pulse:
    case Kind::configure:
      if (step.holds_line && !service_->takes_cycles_) return end_service(State::refused);
      step_ = step;
      wants_ = true;
      return;
  }
}

// Returns whether the step that the service wants begins now; if so, sets `step` to it.
template <class Item, class Read>
bool CyclicHost<Item, Read>::begin_service(Step<Item>& step, Time now) {
  if (!wants_) return false;
  Time start = std::max({now, step_.at, rested_at_});
  if (carries_) start = std::max(start, cycle_.begun);
  // A reply that ends just when the cycle begins would be handled behind the begin.
  const bool fits = step_.kind == Kind::configure || duration(step_) < due_ - start;
  if (!fits && !is_row_ && !takes_ && !carries_) {
    // The request can never fit between two positions if it does not fit directly behind a position.
    is_too_long_ = is_too_long_ || (now == free_since_ && step_.at <= std::max(now, rested_at_));
    if (is_too_long_ && !service_->takes_cycles_) {
      service_->needs_ = duration(step_);
      end_service(State::refused);
    }
    return false;
  }
  step = step_;
  wants_ = takes_ = false;
  if (step.kind == Kind::configure) {
    set_rate(step);
    wake_ = now;
    return true;
  }
  step.at = start;
  is_row_ = step.holds_line || step.goes_on;
  user_ = User::service;
  begin_transfer(step);
  return true;
}

template <class Item, class Read>
void CyclicHost<Item, Read>::end_service(typename Service<Item>::State state) {
  service_->state_ = state;
  service_ = service_->next_;
  if (service_ == nullptr) last_ = nullptr;
  wants_ = takes_ = carries_ = is_row_ = is_too_long_ = false;
  wake_ = Time::min();
}

// ---- The line

template <class Item, class Read>
void CyclicHost<Item, Read>::begin_transfer(Step<Item>& step) {
  if (plan_.answer != Time{}) step.answer = std::min(step.answer, plan_.answer);
  in_transfer_ = true;
  ends_by_items_ = step.answer == Time{} && step.gap == Time{} && step.expect != 0;
}

// Limits the wait in `step` to the plan's time for an answer, and to the begin of the next cycle.
template <class Item, class Read>
void CyclicHost<Item, Read>::limit(Step<Item>& step, Time now) const {
  if (plan_.answer != Time{}) step.answer = std::min(step.answer, plan_.answer);
  step.at = std::min(step.at > now ? step.at : never, due_);
}

// Returns the duration of the items of a transfer and its reply, or of a pulse.
template <class Item, class Read>
Time CyclicHost<Item, Read>::transfer_time(const Step<Item>& step) const {
  LineSettings line = plan_.line.with_some_rate();
  if (step.rate != 0) line.rate = step.rate;
  if (step.kind == Kind::pulse) return step.width;
  if (step.bits != 0) return line.bits(step.bits + line.idle_clocks) + (step.goes_on ? step.width : Time{});
  if constexpr (is_can) {
    // number of bits of an extended CAN frame with 8 data bytes, with stuff bits
    constexpr unsigned longest_frame = 160;
    return line.bits(longest_frame * (step.out.size() + step.expect));
  } else {
    // only a transfer on an SPI link expects items without a time limit for an answer
    if (step.answer == Time{} && step.expect != 0) {
      return line.select_lead + line.bits(8 * std::max(step.out.size(), step.expect));
    }
    const Time pauses = step.frame != 0 ? static_cast<int>(step.out.size() / step.frame) * step.width : Time{};
    return static_cast<int>(step.out.size() + step.expect) * line.byte_time() + pauses;
  }
}

// Returns the longest time that the transfer or pulse and its reply can take; `never`: its reply has no known length.
template <class Item, class Read>
Time CyclicHost<Item, Read>::duration(const Step<Item>& step) const {
  if (step.answer != Time{} && step.expect == 0) return never;
  const Time answer = plan_.answer != Time{} ? std::min(step.answer, plan_.answer) : step.answer;
  return transfer_time(step) + answer + step.gap + plan_.latency;
}

}  // namespace absenc::host
