// SPDX-License-Identifier: Apache-2.0
// Measures how late this computer wakes a thread: a reply delayed by no more than the measured time may be punctual.
#pragma once

#include <atomic>
#include <chrono>
#include <thread>

#include "absenc/core/time.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

/// A measurement of late wake-ups: sleeps for a millisecond again and again in its own thread, as long as it exists.
class WakeupWatch {
 public:
  /// Returns the longest delay of a wake-up that was measured so far.
  [[nodiscard]] Time latest() const { return Time(latest_.load()); }

 private:
  static constexpr std::chrono::milliseconds pause{1};

  void watch(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const Time due = now() + pause;
      std::this_thread::sleep_for(pause);
      const Time::rep late = (now() - due).count();
      if (late > latest_.load()) latest_.store(late);
    }
  }

  std::atomic<Time::rep> latest_{0};
  std::jthread thread_{[this](const std::stop_token& stop) { watch(stop); }};
};

}  // namespace absenc::os
