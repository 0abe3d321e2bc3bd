// SPDX-License-Identifier: Apache-2.0
// Waits for bytes on a few descriptors, for a deadline, and for SIGINT or SIGTERM.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "absenc/core/time.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

class Poller {
 public:
  // Greatest number of descriptors that one call of `wait` returns.
  static constexpr std::size_t most_ready = 16;

  /// Creates the epoll and timer descriptors. Throws Failure.
  Poller();

  /// Makes `wait` report `descriptor` when it is readable or has an error. Throws Failure.
  void add(int descriptor);
  /// Stops watching `descriptor`; call it before the descriptor is closed.
  void remove(int descriptor);

  /// Blocks until an added descriptor is readable or has an error, and returns these descriptors; none if `deadline`
  /// is reached. Throws Interrupted, Ended and Failure.
  [[nodiscard]] std::span<const int> wait(Time deadline);

 private:
  void arm(Time deadline);

  Descriptor epoll_;
  Descriptor timer_;
  Time armed_ = never;   // time at which `timer_` expires; `never` if it is not set
  int interrupts_ = -1;  // descriptor that is readable after SIGINT or SIGTERM; -1 while these signals are not caught
  std::array<int, most_ready> ready_{};
};

}  // namespace absenc::os
