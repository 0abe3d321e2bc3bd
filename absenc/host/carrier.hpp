// SPDX-License-Identifier: Apache-2.0
// Runs a machine from interrupts, where a program cannot wait as host::drive does; see docs/firmware.md.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/link/step.hpp"

namespace absenc::host {

/// A driver of conversations on a line. Call all members in one context, for example from interrupts of one priority.
///
/// `Line` must have these functions: `void begin(const Step<Item>&)`, which does not wait for the end of the step, and
/// `void result(bool over)`, for which `over` is false at `emit` and true at `done`.
template <class Item, class Line>
class Carrier {
 public:
  /// Makes a driver for `line`. `latency`: delay of the path to the encoder, which is added to each limit of silence.
  explicit Carrier(Line& line, Time latency = {}) : line_(&line), latency_(latency) {}

  /// Starts the conversation `machine`, which must live until it has ended. Abandons a conversation that still runs.
  void start(Machine<Item>& machine, Time now) {
    machine_ = &machine;
    expected_ = gathered_ = 0;
    sending_ = waiting_ = item_received_ = false;
    // no silence is to be reported until a transfer or pulse was sent, or an item or a line error arrived
    silence_reported_ = true;
    take_steps(now);
  }
  /// Returns whether a conversation runs.
  [[nodiscard]] bool is_busy() const { return machine_ != nullptr; }

  /// Reports that the last bit of the transfer, of one of its frames, or of the pulse was sent.
  void sent(Time now) {
    if (!is_busy() || !sending_) return;
    if (has_more_frames()) return wait_for_frame(now);
    sending_ = item_received_ = silence_reported_ = false;
    silent_since_ = now;
    deliver({.kind = Event<Item>::Kind::sent, .at = now});
  }
  /// Reports received items; they are dropped while no conversation runs.
  void received(std::span<const Item> items, Time now) {
    if (items.size() == 1 && gathered_ + 1u < expected_) return gather(items.front(), now);
    take_input(items, now);
  }
  /// Reports a character with a wrong stop or parity bit.
  void line_error(Time now) {
    deliver_gathered();
    deliver_input({.kind = Event<Item>::Kind::line_error, .at = now});
  }

  /// Carries out the actions that are due at `now`. Call it at `due()`; further calls do no harm.
  void tick(Time now) {
    if (now < due()) return;
    deliver_gathered();
    if (now < due()) return;
    if (waiting_) {
      waiting_ = false;
      sending_ = true;
      return begin_stored();
    }
    if (now >= silence_end()) {
      silence_reported_ = true;
      ++silences_;
      return deliver({.kind = Event<Item>::Kind::silence, .at = now});
    }
    at_ = never;
    deliver({.kind = Event<Item>::Kind::timer, .at = now});
  }
  /// Takes the machine's next steps. Call it after the machine was changed by a call instead of an event.
  void wake(Time now) {
    if (is_busy() && !waiting_ && !sending_) take_steps(now);
  }
  /// Returns the next time at which `tick` must be called; `never` if it need not be called.
  [[nodiscard]] Time due() const {
    if (!is_busy()) return never;
    return waiting_ ? step_.at : std::min(at_, silence_end());
  }
  /// Returns how many `silence` events were reported to machines, for example because a reply was missing.
  [[nodiscard]] std::uint32_t silences() const { return silences_; }

 private:
  using Kind = typename Step<Item>::Kind;

  [[nodiscard]] bool has_more_frames() const { return step_.frame != 0 && step_.out.size() > step_.frame; }
  // Begins the stored transfer or pulse; of a transfer in frames, begins its first frame.
  void begin_stored() {
    if (!has_more_frames()) return line_->begin(step_);
    Step<Item> first = step_;
    first.out = step_.out.first(step_.frame);
    line_->begin(first);
  }
  // Removes the frame that was sent from the stored transfer; the other frames wait for the end of the pause.
  void wait_for_frame(Time now) {
    step_.out = step_.out.subspan(step_.frame);
    step_.at = now + step_.width;
    sending_ = false;
    waiting_ = true;
  }
  void gather(Item item, Time now) {
    items_[gathered_++] = item;
    item_received_ = true;
    silence_reported_ = false;
    silent_since_ = now;
  }
  void take_input(std::span<const Item> items, Time now) {
    if (gathered_ != 0 && items.size() == 1) {
      gather(items.front(), now);
      return deliver_gathered();
    }
    deliver_gathered();
    deliver_input({.kind = Event<Item>::Kind::received, .at = now, .items = items});
  }
  void deliver_gathered() {
    if (gathered_ == 0) return;
    const std::span<const Item> items(items_.data(), gathered_);
    gathered_ = 0;
    deliver({.kind = Event<Item>::Kind::received, .at = silent_since_, .items = items});
  }
  void deliver_input(const Event<Item>& event) {
    if (!is_busy()) return;
    item_received_ = true;
    silence_reported_ = sending_;
    silent_since_ = event.at;
    deliver(event);
  }
  void deliver(const Event<Item>& event) {
    machine_->feed(event);
    take_steps(event.at);
  }
  [[nodiscard]] Time silence_end() const {
    const Time limit = item_received_ ? gap_ : answer_;
    return silence_reported_ || limit == Time{} ? never : silent_since_ + limit + latency_;
  }

  // Takes the machine's steps until it waits or is done.
  void take_steps(Time now) {
    for (;;) {
      const Step<Item> step = machine_->next(now);
      switch (step.kind) {
        case Kind::done:
          machine_ = nullptr;
          expected_ = 0;
          return line_->result(true);
        case Kind::emit:
          line_->result(false);
          break;
        case Kind::configure:
          line_->begin(step);
          break;
        case Kind::transfer:
        case Kind::pulse:
          if constexpr (requires { line_->hold_clock(true); }) {
            if (step.bits != 0) line_->hold_clock(step.hold_low);
          }
          waiting_ = step.at > now;
          sending_ = !waiting_;
          silence_reported_ = true;
          expected_ = 0;
          if (waiting_ || step.frame != 0) step_ = step;
          if (!waiting_ && step.frame != 0) {
            begin_stored();
          } else if (!waiting_) {
            line_->begin(step);
          }
          break;
        case Kind::wait:
          answer_ = step.answer;
          gap_ = step.gap;
          at_ = step.at > now ? step.at : never;
          // Without a `gap` limit no silence would deliver characters that were gathered, so none are gathered.
          expected_ = gap_ == Time{} ? 0 : static_cast<std::uint8_t>(std::min(step.expect, room));
          return;
      }
    }
  }

  // greatest number of received characters that are gathered before they are delivered
  static constexpr std::size_t room = sizeof(Item) == 1 ? 16 : 1;

  // Members that are used for every received character come first, so that short instructions can address them.
  std::uint8_t expected_ = 0;  // number of received characters to deliver together; below 2: each character at once
  std::uint8_t gathered_ = 0;
  bool waiting_ = false;
  bool sending_ = false;
  bool item_received_ = false;  // an item or line error arrived since the last transfer or pulse was sent
  bool silence_reported_ = true;
  Time silent_since_{};
  std::array<Item, room> items_;  // received characters that were gathered and not yet delivered to the machine
  Line* line_;
  Machine<Item>* machine_ = nullptr;
  Time latency_;
  Time answer_{};
  Time gap_{};
  Time at_ = never;
  Step<Item> step_{};  // transfer or pulse that waits for its time, or whose frames are being sent
  std::uint32_t silences_ = 0;
};

}  // namespace absenc::host
