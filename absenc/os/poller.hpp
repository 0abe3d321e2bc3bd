// SPDX-License-Identifier: Apache-2.0
// Waits for bytes on a few descriptors, for a deadline, and for Ctrl-C.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "absenc/core/time.hpp"

namespace absenc::os {

class Poller {
 public:
  // Greatest number of descriptors that one call of `wait` returns.
  static constexpr std::size_t most_ready = 16;

  /// Throws Failure if the system has no room for what it needs.
  Poller();
  ~Poller();
  Poller(const Poller&) = delete;
  Poller& operator=(const Poller&) = delete;

  /// Makes `wait` report `descriptor` when it is readable or has an error. Throws Failure.
  void add(int descriptor);
  /// Stops watching `descriptor`; call it before the descriptor is closed.
  void remove(int descriptor);

  /// Blocks until an added descriptor is readable or has an error, and returns these descriptors; none if `deadline`
  /// is reached. Throws Interrupted, Ended and Failure.
  [[nodiscard]] std::span<const int> wait(Time deadline);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace absenc::os
