// SPDX-License-Identifier: Apache-2.0
// Writes the history of `absenc serve` in a thread of its own.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absenc/serve/fleet.hpp"
#include "absenc/serve/history.hpp"

namespace absenc::serve {

/// Detects jumps of the calendar clock.
class ClockWatch {
 public:
  // Smallest change of the calendar clock that counts as a jump, in milliseconds.
  static constexpr std::int64_t smallest_jump_ms = 10'000;

  /// Returns by how much the calendar clock has jumped since the last call, in milliseconds; 0 if by less than
  /// `smallest_jump_ms`. `now` is a time of os::now.
  std::int64_t check(std::int64_t calendar_ms, Time now);

 private:
  bool has_checked_ = false;
  std::int64_t calendar_ = 0;
  Time at_{};
};

class Chronicler {
 public:
  /// `fleet` and `server_events` must outlive this object. Throws HistoryInUse.
  Chronicler(const std::string& path, const HistoryLimits& limits, const Fleet& fleet, ServerEvents& server_events);
  /// Writes the remaining events, and the values of the remaining seconds, into the history.
  ~Chronicler();

  /// Adds events to be written. `added`: number of all events since the start of the server, including these
  /// (ServerEvents::added).
  void add(const std::vector<ServerEvent>& server_events, std::uint64_t added);
  /// Calls `then`, possibly in another thread, when the first `added` events of the server were written, or cannot be
  /// written.
  void when_written(std::uint64_t added, std::function<void()> then);

  struct Health {
    std::string trouble{};  // why the history cannot be written; "" without an error
    std::uint64_t lost = 0;
  };
  [[nodiscard]] Health health() const;
  [[nodiscard]] HistoryReader& reader() { return writer_.reader(); }

 private:
  void work(const std::stop_token& stop);
  void check_clock();
  void write();
  [[nodiscard]] bool has_ready_caller() const;

  HistoryWriter writer_;
  const Fleet* fleet_;
  ServerEvents* server_events_;
  ClockWatch clock_;
  mutable std::mutex mutex_;  // mutex that guards all members below except `thread_`
  std::condition_variable_any changed_;
  std::vector<ServerEvent> unwritten_events_;
  std::uint64_t added_ = 0;  // number of events since the server started, including `unwritten_events_`
  std::vector<std::pair<std::uint64_t, std::function<void()>>> waiting_;
  Health health_;
  std::jthread thread_;  // the last member: when the thread starts, all members that it uses exist
};

}  // namespace absenc::serve
