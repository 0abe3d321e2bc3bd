// SPDX-License-Identifier: Apache-2.0
// Measures this computer's own delays: a reply that seems late by no more than these may have been punctual on the
// line.
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
  /// `terminals`: whether to measure the delays of pseudo-terminals, too, as far as they can be opened.
  explicit DelayWatch(bool terminals);

  /// Returns the longest delay measured so far.
  [[nodiscard]] Time latest() const { return Time(latest_.load()); }

 private:
  /// A pseudo-terminal through which one byte at a time is sent, from its master to its slave.
  struct ByteLoop {
    TerminalPair terminal{};
    Time due{};      // when the next byte is to be sent, if no byte is between master and slave
    Time sent_at{};  // when the byte between master and slave was sent
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
