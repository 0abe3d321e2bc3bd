// SPDX-License-Identifier: Apache-2.0
// The interface between a machine's driver loop and one end of a real or simulated line.
#pragma once

#include "absenc/link/step.hpp"

namespace absenc {

/// One end of a line: carries out steps and reports events. Ports of the operating system may throw (os/error.hpp).
template <class Item>
struct Port {
  /// Returns the time on the port's own clock, which never runs backwards.
  [[nodiscard]] virtual Time now() = 0;

  /// Begins a transfer, pulse or configure step. Items may be reported before the event `sent` of this step.
  virtual void begin(const Step<Item>& step) = 0;

  /// Blocks until the next event for a machine that waits with `step`, and returns it. The items of the event are valid
  /// until the next `wait`.
  [[nodiscard]] virtual Event<Item> wait(const Step<Item>& step) = 0;

 protected:
  ~Port() = default;
};

}  // namespace absenc
