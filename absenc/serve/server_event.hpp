// SPDX-License-Identifier: Apache-2.0
// Events that the server records for people: alarms, losses, changes, commands.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absenc/client/text/json.hpp"

namespace absenc::serve {

/// Returns the calendar time in microseconds since 1970.
[[nodiscard]] inline std::int64_t calendar_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}
[[nodiscard]] inline std::int64_t calendar_ms() { return calendar_us() / 1000; }

struct ServerEvent {
  std::int64_t at_ms = 0;
  std::string encoder{};  // name of the encoder of the event; "": the server itself
  // Kind of the event: alarm, lost, back, command, mqtt ...
  std::string kind{};
  std::string text{};
  std::string who{};  // user, or address of the client, that caused the event; "" if none did

  [[nodiscard]] client::Json json() const {
    return client::Json::object()
        .set("at_ms", at_ms)
        .set("encoder", encoder)
        .set("kind", kind)
        .set("text", text)
        .set("who", who);
  }
};

/// A bounded queue of events between threads. A flood of events drops the oldest.
class ServerEvents {
 public:
  static constexpr std::size_t most = 10'000;

  void add(ServerEvent server_event) {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(server_event));
    ++added_;
    if (waiting_.size() <= most) return;
    waiting_.pop_front();
    ++dropped_;
  }

  /// Returns the number of events that were added since the start of the server.
  [[nodiscard]] std::uint64_t added() const {
    const std::lock_guard lock(mutex_);
    return added_;
  }

  /// Takes the queued events, oldest first. `added`: receives the number of events that were added since the start of
  /// the server.
  [[nodiscard]] std::vector<ServerEvent> take(std::uint64_t& added) {
    const std::lock_guard lock(mutex_);
    added = added_;
    std::vector<ServerEvent> taken(std::make_move_iterator(waiting_.begin()), std::make_move_iterator(waiting_.end()));
    waiting_.clear();
    if (dropped_ != 0) {
      taken.push_back({calendar_ms(), "", "history", std::to_string(dropped_) + " older events were dropped"});
      dropped_ = 0;
    }
    return taken;
  }

 private:
  mutable std::mutex mutex_;
  std::deque<ServerEvent> waiting_;
  std::uint64_t added_ = 0;
  std::size_t dropped_ = 0;
};

}  // namespace absenc::serve
