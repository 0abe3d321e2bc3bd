// SPDX-License-Identifier: Apache-2.0
// Runs a virtual encoder on a port that may be lost and come back.
#pragma once

#include <algorithm>
#include <string_view>

#include "absenc/host/drive.hpp"
#include "absenc/link/step.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

/// A change of the port that is reported to the caller.
enum class PortEvent : std::uint8_t { opened, away, back };

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

  /// Returns the last rate that the encoder set on a port; 0: it set none.
  [[nodiscard]] std::uint32_t rate() const { return rate_; }

 private:
  Machine<Item>* inner_;
  bool sending_ = false;
  std::uint32_t rate_ = 0;
};

/// Serves the encoder, and opens a lost port again. Returns only by an exception.
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
      told(was_open ? PortEvent::back : PortEvent::opened, {});
      is_open = was_open = true;
      host::drive(movable, *port, [] { return true; });
    } catch (const os::Failure& failure) {
      // An open port that does not support a rate will not support it after it is opened again.
      const bool unable = is_open && failure.kind() == os::Failure::Kind::unsupported;
      if (!was_open || unable) throw;
      if (is_open) told(PortEvent::away, failure.what());
      is_open = false;
    }
    wait(os::now() + time_between_tries);
  }
}

}  // namespace absenc::client
