// SPDX-License-Identifier: Apache-2.0
// Measures how late this computer is: a reply that is no later may be punctual.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/os/terminal_pair.hpp"

namespace absenc::os {

/// A thread that measures this computer's own delays as long as the object exists.
class DelayWatch {
 public:
  /// `terminals`: whether to measure pseudo-terminals, too, as far as they can be opened.
  explicit DelayWatch(bool terminals);

  /// Returns the longest delay that was measured so far.
  [[nodiscard]] Time latest() const { return Time(latest_.load()); }

 private:
  /// A pseudo-terminal through which one byte at a time is sent, from its master to its slave.
  struct ByteLoop {
    TerminalPair terminal{};
    Time due{};      // when the next byte is sent, if none is on its way
    Time sent_at{};  // when the byte that is on its way was sent
    bool is_out = false;
  };

  void watch(const std::stop_token& stop);
  void exchange(ByteLoop& loop);
  void note(Time delay);

  std::vector<ByteLoop> loops_{};
  std::atomic<Time::rep> latest_{0};
  std::jthread thread_;
};

}  // namespace absenc::os
