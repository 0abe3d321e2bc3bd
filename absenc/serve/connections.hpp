// SPDX-License-Identifier: Apache-2.0
// Selects the connection to close when too many are open. One address cannot shut out others, and the longest idle
// connection is closed first.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <unordered_map>

#include "absenc/core/time.hpp"

namespace absenc::serve {

/// Not thread-safe.
class Connections {
 public:
  static constexpr std::size_t most = 480;             // connections for any request
  static constexpr std::size_t most_of_address = 384;  // connections of one address, so that one client or proxy leaves
                                                       // room for others
  static constexpr std::size_t reserve = 32;           // additional connections, for vital requests only
  static constexpr Time request_time = std::chrono::seconds(10);  // time limit for a whole request, even if bytes still
                                                                  // arrive

  using Id = const void*;
  /// `end` closes the connection of a socket; the call of `remove` may follow later.
  explicit Connections(std::function<void(int socket)> end) : end_(std::move(end)) {}

  /// Adds a connection. Closes another one, or this one, when the limit is exceeded.
  void add(Id id, int socket, std::string peer, Time now);
  void remove(Id id) { open_.erase(id); }
  /// A whole request was received; the connection is not idle until `await_request`.
  void begin_request(Id id);
  void await_request(Id id, Time now);
  /// Returns whether the connection belongs to the reserve, which serves vital requests only.
  [[nodiscard]] bool is_in_reserve(Id id) const;
  /// Closes connections whose request has been incomplete for longer than `request_time`.
  void end_incomplete_requests(Time now);

 private:
  struct Open {
    int socket = -1;
    std::string peer{};
    Time idle_since = never;  // `never` while a request is being answered
    bool in_reserve = false;
    bool ended = false;
  };

  void end(Open& one);
  bool end_oldest_idle(Id excluded, const std::function<bool(const Open&)>& matches);
  bool end_oldest_idle_of_busiest(Id excluded);
  [[nodiscard]] std::size_t count(const std::function<bool(const Open&)>& matches) const;

  std::function<void(int)> end_;
  std::unordered_map<Id, Open> open_;
};

}  // namespace absenc::serve
