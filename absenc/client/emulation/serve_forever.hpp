// SPDX-License-Identifier: Apache-2.0
// A virtual encoder on a port that may go away and come back.
#pragma once

#include <algorithm>
#include <string_view>

#include "absenc/host/drive.hpp"
#include "absenc/link/step.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

/// What has become of the port.
enum class Served : std::uint8_t { opened, away, back };

/// Goes from one port to the next: the last one may have gone away between a transfer and its `sent`.
template <class Item>
class Movable final : public Machine<Item> {
 public:
  explicit Movable(Machine<Item>& inner) : inner_(&inner) {}

  void feed(const Event<Item>& event) override {
    if (event.kind == Event<Item>::Kind::sent) sending_ = false;
    inner_->feed(event);
  }

  Step<Item> next(Time now) override {
    const Step<Item> step = inner_->next(now);
    if (step.kind == Step<Item>::Kind::transfer) sending_ = true;
    if (step.kind == Step<Item>::Kind::configure) rate_ = step.rate;
    return step;
  }

  void left(Time now) {
    if (sending_) feed({.kind = Event<Item>::Kind::sent, .at = now});
  }

  /// What it has set the last port to; 0: nothing.
  [[nodiscard]] std::uint32_t rate() const { return rate_; }

 private:
  Machine<Item>* inner_;
  bool sending_ = false;
  std::uint32_t rate_ = 0;
};

/// Without end: what `open`, the port or `wait` throws ends it. `open()` makes the port; one that is lost, which
/// os::Failure tells, is tried again. Between tries `wait(time)` is called. `told(what, why)` hears of the port.
template <class Item, class Open, class Wait, class Told>
[[noreturn]] void serve_forever(Machine<Item>& machine, const Open& open, const Wait& wait, const Told& told) {
  constexpr Time time_between_tries = std::chrono::milliseconds(250);
  Movable<Item> movable(machine);
  bool is_open = false;
  bool was_open = false;
  for (;;) {
    try {
      const auto port = open();
      if (was_open) {
        movable.left(port->now());
        if (movable.rate() != 0) {
          port->begin({.kind = Step<Item>::Kind::configure, .rate = movable.rate()});
        }
      }
      told(was_open ? Served::back : Served::opened, {});
      is_open = was_open = true;
      host::drive(movable, *port, [] { return true; });
    } catch (const os::Failure& failure) {
      // What the port cannot do, it cannot do later either.
      const bool unable = is_open && failure.kind() == os::Failure::Kind::unsupported;
      if (!was_open || unable) throw;
      if (is_open) told(Served::away, failure.what());
      is_open = false;
    }
    wait(os::now() + time_between_tries);
  }
}

}  // namespace absenc::client
