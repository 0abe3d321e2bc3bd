// SPDX-License-Identifier: Apache-2.0
// Chooses the connection that goes when too many are open: no address shuts others out, and the oldest idle one goes
// first.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <unordered_map>

#include "absenc/core/time.hpp"

namespace absenc::serve {

/// Not guarded against several threads.
class Connections {
 public:
  static constexpr std::size_t most = 480;             // for requests of any kind
  static constexpr std::size_t most_of_address = 384;  // so that one client, or one proxy, leaves room for others
  static constexpr std::size_t reserve = 32;           // beside them, for vital requests only
  static constexpr Time request_time = std::chrono::seconds(10);  // a byte now and then does not prolong it

  using Id = const void*;
  /// `end` ends the connection of a socket; `remove` may come later.
  explicit Connections(std::function<void(int socket)> end) : end_(std::move(end)) {}

  /// Ends another one, or this one, where there are too many.
  void add(Id id, int socket, std::string peer, Time now);
  void remove(Id id) { open_.erase(id); }
  /// A whole request came; until `await_request` the connection is not idle.
  void begin_request(Id id);
  void await_request(Id id, Time now);
  /// Whether it is one of the reserve, which answers vital requests only.
  [[nodiscard]] bool is_of_reserve(Id id) const;
  /// Ends those that have awaited the end of a request for longer than `request_time`.
  void end_half_sent(Time now);

 private:
  struct Open {
    int socket = -1;
    std::string peer{};
    Time idle_since = never;  // `never`: a request is being answered
    bool of_reserve = false;
    bool ended = false;
  };

  void end(Open& one);
  bool end_oldest_idle(Id but, const std::function<bool(const Open&)>& matches);
  bool end_oldest_idle_of_busiest(Id but);
  [[nodiscard]] std::size_t count(const std::function<bool(const Open&)>& matches) const;

  std::function<void(int)> end_;
  std::unordered_map<Id, Open> open_;
};

}  // namespace absenc::serve
