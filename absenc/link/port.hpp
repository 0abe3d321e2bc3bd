// SPDX-License-Identifier: Apache-2.0
// The interface between a machine's driver loop and one end of a real or simulated line.
#pragma once

#include "absenc/link/step.hpp"

namespace absenc {

/// One end of a line: carries out steps and reports events. Ports of the operating system throw on failure
/// (os/error.hpp). The interface is defined in link so that the loop in host/drive.hpp needs no os, and os does not
/// depend on host.
template <class Item>
struct Port {
  /// Returns the time on the port's own clock, which also stamps every event and never runs backwards.
  [[nodiscard]] virtual Time now() = 0;

  /// Begins a transfer, pulse or configure step. `sent` is reported at the end of a transfer or pulse; before it may
  /// come items that arrive earlier (the echo of a half-duplex line, an unsolicited reply), and the timer of a wait.
  virtual void begin(const Step<Item>& step) = 0;

  /// Blocks until the next event that a machine waiting with `step` must see, and returns it. Its items stay valid
  /// until the next call of `wait`.
  [[nodiscard]] virtual Event<Item> wait(const Step<Item>& step) = 0;

 protected:
  ~Port() = default;
};

}  // namespace absenc
