// SPDX-License-Identifier: Apache-2.0
// One end of a real or simulated line, as a machine's carrier sees it.
#pragma once

#include "absenc/link/step.hpp"

namespace absenc {

/// Carries out steps and reports events. Ports of the operating system throw on failure (os/error.hpp);
/// a port on a microcontroller reports it as `line_error`. An interface here, so that the loop that drives a machine
/// exists once (host/drive.hpp) and os needs nothing from host.
template <class Item>
struct Port {
  /// The port's own clock, which stamps every event; it never runs backwards.
  [[nodiscard]] virtual Time now() = 0;

  /// Begins a transfer, pulse or configure step. After a transfer or pulse, `sent` is the next event, unless something
  /// was heard before its end (the echo of a half-duplex line, an encoder that talks out of turn).
  virtual void begin(const Step<Item>& step) = 0;

  /// Blocks until the next event that a machine waiting with this step must see. Items stay valid until the next call.
  [[nodiscard]] virtual Event<Item> wait(const Step<Item>& step) = 0;

 protected:
  ~Port() = default;
};

}  // namespace absenc
