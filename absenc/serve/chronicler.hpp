// SPDX-License-Identifier: Apache-2.0
// Writes the history once a second, in a thread of its own: a slow disk delays nobody else.
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

/// Notices when the calendar's clock jumps.
class ClockWatch {
 public:
  static constexpr std::int64_t smallest_jump_ms = 10'000;  // NTP moves it by less

  /// Returns by how much it has jumped since the last look, in milliseconds; 0: it has not. `now`: of os::now.
  std::int64_t look(std::int64_t calendar_ms, Time now);

 private:
  bool looked_ = false;
  std::int64_t calendar_ = 0;
  Time at_{};
};

class Chronicler {
 public:
  /// `fleet` and `server_events`, which is told what happens to the history, outlive it. Throws HistoryInUse.
  Chronicler(const std::string& path, const HistoryLimits& limits, const Fleet& fleet, ServerEvents& server_events);
  /// Writes what there still is.
  ~Chronicler();

  /// `added`: how many there have been with them (ServerEvents::added).
  void add(const std::vector<ServerEvent>& server_events, std::uint64_t added);
  /// Calls `then` once the first `added` server_events are in the file, so that kill -9 does not lose them, or could
  /// not be written; from the thread of the history.
  void when_written(std::uint64_t added, std::function<void()> then);

  struct Health {
    std::string trouble{};  // why nothing can be written; "": nothing is wrong
    std::uint64_t lost = 0;
  };
  [[nodiscard]] Health health() const;
  [[nodiscard]] HistoryReader& reader() { return writer_.reader(); }

 private:
  void work(const std::stop_token& stop);
  void look_at_clock();
  void write();
  [[nodiscard]] bool is_awaited() const;

  HistoryWriter writer_;
  const Fleet* fleet_;
  ServerEvents* told_;
  ClockWatch clock_;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any changed_;
  std::vector<ServerEvent> server_events_;
  std::uint64_t added_ = 0;  // with those of `server_events_`
  std::vector<std::pair<std::uint64_t, std::function<void()>>> waiting_;
  Health health_;
  std::jthread thread_;  // last: it uses all of the others
};

}  // namespace absenc::serve
