// SPDX-License-Identifier: Apache-2.0
// Runs a machine on a port: the loop for programs that may block while they wait.
#pragma once

#include "absenc/link/port.hpp"

namespace absenc::host {

/// Runs `machine` on `port`; `on_emit()` returns whether to continue after an `emit`. Returns whether the machine is
/// done. Exceptions pass through.
template <class Item, class OnEmit>
bool drive(Machine<Item>& machine, Port<Item>& port, OnEmit&& on_emit) {
  // The time of the last event is taken as the present time until the next event, because reading the clock takes time.
  for (Time now = port.now();;) {
    const Step<Item> step = machine.next(now);
    switch (step.kind) {
      case Step<Item>::Kind::done:
        return true;
      case Step<Item>::Kind::emit:
        if (!on_emit()) return false;
        break;
      case Step<Item>::Kind::wait: {
        const Event<Item> event = port.wait(step);
        now = event.at;
        machine.feed(event);
        break;
      }
      case Step<Item>::Kind::transfer:
      case Step<Item>::Kind::pulse:
      case Step<Item>::Kind::configure:
        port.begin(step);
        break;
    }
  }
}

/// Feeds the items that have arrived at `port` to a machine that streams, and drops its results.
template <class Item>
void catch_up(Machine<Item>& machine, Port<Item>& port) {
  for (Time now = port.now();;) {
    Step<Item> step = machine.next(now);
    if (step.kind == Step<Item>::Kind::emit) continue;
    if (step.kind != Step<Item>::Kind::wait) return;  // the machine is done, and will return `done` again to `drive`
    const Time due = step.at;
    // A timer 1 ns ahead ends the wait only after the port has delivered all items that have already arrived.
    step.at = port.now() + Time{1};
    const Event<Item> event = port.wait(step);
    now = event.at;
    if (event.kind != Event<Item>::Kind::timer) {
      machine.feed(event);
    } else {
      if (due != Time{} && now >= due) machine.feed(event);
      return;
    }
  }
}

}  // namespace absenc::host
