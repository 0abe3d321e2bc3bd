// SPDX-License-Identifier: Apache-2.0
// Waits for bytes on a few descriptors, for a deadline and for Ctrl-C at the price of one system call, however many
// there are: the reason why ports do not use `wait_for`.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "absenc/core/time.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

class Poller {
 public:
  static constexpr std::size_t most_ready = 16;  // told at once; the others come with the next wait

  /// Throws Failure.
  Poller();

  /// From now on `wait` tells when there is something to read, or an error to fetch. Throws Failure.
  void add(int descriptor);
  /// Must come before the descriptor is closed.
  void remove(int descriptor);

  /// Blocks until there is something to read and returns where; empty when `deadline` came first (`never`: none).
  /// What is ready at once is seen even after the deadline. Throws Interrupted, Ended and Failure.
  [[nodiscard]] std::span<const int> wait(Time deadline);

 private:
  void arm(Time deadline);

  Descriptor epoll_;
  Descriptor timer_;
  Time armed_ = never;   // what the timer is set to: never later than the deadline
  int interrupts_ = -1;  // once they are caught
  std::array<int, most_ready> ready_{};
};

}  // namespace absenc::os
