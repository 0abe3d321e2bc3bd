// SPDX-License-Identifier: Apache-2.0
// Carries a machine from interrupts: what host::drive is where a program can wait, in pieces where it cannot. It owns
// no port and no clock; docs/firmware.md has it behind a UART, a DMA channel and a timer.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/link/step.hpp"

namespace absenc::host {

/// All members are called in one context: from interrupts of one priority, or with these held off.
///
/// Line has `void begin(const Step<Item>&)`, which begins a transfer, a pulse or a change of the rate and does not wait
/// for it, and `void result(bool over)`, called for every `emit`, and at `done` with `over`, when `is_busy()` is false
/// again.
template <class Item, class Line>
class Carrier {
 public:
  /// `latency` is what the way to the encoder adds to its answer time: of a UART beside it one character at the most.
  explicit Carrier(Line& line, Time latency = {}) : line_(&line), latency_(latency) {}

  /// Begins a conversation, which must live until it is over. The one before is given up.
  void start(Machine<Item>& machine, Time now) {
    machine_ = &machine;
    expected_ = gathered_ = 0;
    sending_ = held_ = heard_ = false;
    quiet_told_ = true;  // until something was sent
    go_on(now);
  }
  /// Returns whether a conversation runs.
  [[nodiscard]] bool is_busy() const { return machine_ != nullptr; }

  /// The last bit of the transfer, or of the pulse, is out.
  void sent(Time now) {
    if (!is_busy() || !sending_) return;
    sending_ = heard_ = quiet_told_ = false;
    quiet_since_ = now;
    tell({.kind = Event<Item>::Kind::sent, .at = now});
  }
  /// What comes while no conversation runs is nobody's. Single characters are kept until as many are there as the
  /// machine waits for, or the line is quiet, as a DMA channel does: one that others follow takes little time.
  void received(std::span<const Item> items, Time now) {
    if (items.size() == 1 && gathered_ + 1u < expected_) return gather(items.front(), now);
    come(items, now);
  }
  /// A character with a wrong stop or parity bit came.
  void line_error(Time now) {
    tell_gathered();
    came({.kind = Event<Item>::Kind::line_error, .at = now});
  }

  /// To be called when `due()` has come; oftener does no harm. A tick slower than the encoder's limits makes silences
  /// longer, never wrong.
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
  /// When `tick` has something to do; `never`: not before something is sent or comes.
  [[nodiscard]] Time due() const {
    if (!is_busy()) return never;
    return held_ ? step_.at : std::min(at_, quiet_end());
  }
  /// How often a reply did not come, or not to its end, or was followed by silence because it was not good.
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

  // A transfer is remembered until its time has come; what it waits for afterwards stands in the step behind it.
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
          // Where no pause ends what has begun, characters that are kept would never be told.
          expected_ = gap_ == Time{} ? 0 : static_cast<std::uint8_t>(std::min(step.expect, room));
          return;
      }
    }
  }

  // As many as most replies have; longer ones are told in pieces. Of frames each.
  static constexpr std::size_t room = sizeof(Item) == 1 ? 16 : 1;

  // First what every character needs.
  std::uint8_t expected_ = 0;  // characters that may be kept, or one more; 0: none
  std::uint8_t gathered_ = 0;
  bool held_ = false;
  bool sending_ = false;
  bool heard_ = false;  // since the last transfer
  bool quiet_told_ = true;
  Time quiet_since_{};
  std::array<Item, room> items_;  // gathered
  Line* line_;
  Machine<Item>* machine_ = nullptr;
  Time latency_;
  Time answer_{};
  Time gap_{};
  Time at_ = never;
  Step<Item> step_{};  // held until its time
  std::uint32_t silences_ = 0;
};

}  // namespace absenc::host
