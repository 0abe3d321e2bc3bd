// SPDX-License-Identifier: Apache-2.0
// Runs a machine from interrupts, where a program cannot wait as host::drive does. The carrier owns no port and no
// clock; docs/firmware.md connects it to a UART, a DMA channel and a timer.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/link/step.hpp"

namespace absenc::host {

/// Call all members in one context: from interrupts of one priority, or with these disabled.
///
/// Line has `void begin(const Step<Item>&)`, which starts a transfer, a pulse or a change of the rate and does not wait
/// for its end, and `void result(bool over)`. The carrier calls `result(false)` for every `emit`, and `result(true)` at
/// `done`, when `is_busy()` is false again.
template <class Item, class Line>
class Carrier {
 public:
  /// `latency`: delay that the path to the encoder adds to its answer time; for a UART on the chip at most one
  /// character.
  explicit Carrier(Line& line, Time latency = {}) : line_(&line), latency_(latency) {}

  /// Starts a conversation, which must live until it is over. A running conversation is abandoned.
  void start(Machine<Item>& machine, Time now) {
    machine_ = &machine;
    expected_ = gathered_ = 0;
    sending_ = held_ = heard_ = false;
    quiet_told_ = true;  // until a transfer is sent
    go_on(now);
  }
  /// Returns whether a conversation runs.
  [[nodiscard]] bool is_busy() const { return machine_ != nullptr; }

  /// Reports that the last bit of the transfer, or of the pulse, was sent.
  void sent(Time now) {
    if (!is_busy() || !sending_) return;
    sending_ = heard_ = quiet_told_ = false;
    quiet_since_ = now;
    tell({.kind = Event<Item>::Kind::sent, .at = now});
  }
  /// Reports received items; they are dropped while no conversation runs. Single characters are gathered until the
  /// machine's expected number has arrived or the line is silent, as a DMA channel does: gathering one takes little
  /// time.
  void received(std::span<const Item> items, Time now) {
    if (items.size() == 1 && gathered_ + 1u < expected_) return gather(items.front(), now);
    come(items, now);
  }
  /// Reports a character with a wrong stop or parity bit.
  void line_error(Time now) {
    tell_gathered();
    came({.kind = Event<Item>::Kind::line_error, .at = now});
  }

  /// Executes what is due. Call it at `due()`; more calls do no harm. A tick slower than the encoder's limits makes
  /// silences longer, but never wrong.
  void tick(Time now) {
    if (now < due()) return;
    tell_gathered();
    if (now < due()) return;
    if (held_) {
      held_ = false;
      sending_ = true;
      return line_->begin(step_);
    }
    if (now >= quiet_end()) {
      quiet_told_ = true;
      ++silences_;
      return tell({.kind = Event<Item>::Kind::silence, .at = now});
    }
    at_ = never;
    tell({.kind = Event<Item>::Kind::timer, .at = now});
  }
  /// Returns when `tick` has work to do; `never`: only after something is sent or received.
  [[nodiscard]] Time due() const {
    if (!is_busy()) return never;
    return held_ ? step_.at : std::min(at_, quiet_end());
  }
  /// Returns how many replies were missing, incomplete, or followed by silence because they were invalid.
  [[nodiscard]] std::uint32_t silences() const { return silences_; }

 private:
  using Kind = typename Step<Item>::Kind;

  void gather(Item item, Time now) {
    items_[gathered_++] = item;
    heard_ = true;
    quiet_told_ = false;
    quiet_since_ = now;
  }
  void come(std::span<const Item> items, Time now) {
    if (gathered_ != 0 && items.size() == 1) {
      gather(items.front(), now);
      return tell_gathered();
    }
    tell_gathered();
    came({.kind = Event<Item>::Kind::received, .at = now, .items = items});
  }
  void tell_gathered() {
    if (gathered_ == 0) return;
    const std::span<const Item> items(items_.data(), gathered_);
    gathered_ = 0;
    tell({.kind = Event<Item>::Kind::received, .at = quiet_since_, .items = items});
  }
  void came(const Event<Item>& event) {
    if (!is_busy()) return;
    heard_ = true;
    quiet_told_ = sending_;
    quiet_since_ = event.at;
    tell(event);
  }
  void tell(const Event<Item>& event) {
    machine_->feed(event);
    go_on(event.at);
  }
  [[nodiscard]] Time quiet_end() const {
    const Time limit = heard_ ? gap_ : answer_;
    return quiet_told_ || limit == Time{} ? never : quiet_since_ + limit + latency_;
  }

  // Takes the machine's steps until it waits. A transfer is stored until its time; its limits of silence are in the
  // wait step after it.
  void go_on(Time now) {
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
          held_ = step.at > now;
          sending_ = !held_;
          quiet_told_ = true;
          expected_ = 0;
          if (held_) {
            step_ = step;
          } else {
            line_->begin(step);
          }
          break;
        case Kind::wait:
          answer_ = step.answer;
          gap_ = step.gap;
          at_ = step.at > now ? step.at : never;
          // Without a gap limit no silence would deliver the gathered characters.
          expected_ = gap_ == Time{} ? 0 : static_cast<std::uint8_t>(std::min(step.expect, room));
          return;
      }
    }
  }

  // Characters of most replies; longer ones are delivered in pieces. CAN: one frame.
  static constexpr std::size_t room = sizeof(Item) == 1 ? 16 : 1;

  // Members that every received character needs come first, for short instructions.
  std::uint8_t expected_ = 0;  // characters to gather, or one more; 0: none
  std::uint8_t gathered_ = 0;
  bool held_ = false;
  bool sending_ = false;
  bool heard_ = false;  // an item arrived since the last transfer
  bool quiet_told_ = true;
  Time quiet_since_{};
  std::array<Item, room> items_;  // gathered characters
  Line* line_;
  Machine<Item>* machine_ = nullptr;
  Time latency_;
  Time answer_{};
  Time gap_{};
  Time at_ = never;
  Step<Item> step_{};  // transfer that waits for its time
  std::uint32_t silences_ = 0;
};

}  // namespace absenc::host
