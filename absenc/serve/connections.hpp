// SPDX-License-Identifier: Apache-2.0
// Selects the HTTP connection to close when too many are open.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <unordered_map>

#include "absenc/core/time.hpp"

namespace absenc::serve {

/// The open HTTP connections of the server. Not thread-safe.
class Connections {
 public:
  // Greatest number of connections that may carry any request. Further connections belong to the reserve.
  static constexpr std::size_t most = 480;
  // Greatest number of those `most` connections that one IP address may have, so that other addresses have room, too.
  static constexpr std::size_t most_of_address = 384;
  // greatest number of connections in the reserve; these carry only vital requests: health check and metrics
  static constexpr std::size_t reserve = 32;
  // Time within which a connection must send a complete request, even if bytes still arrive.
  static constexpr Time request_time = std::chrono::seconds(10);

  using Id = const void*;
  /// `end` shuts down the socket of a connection; the server calls `remove` for the connection at once or later.
  explicit Connections(std::function<void(int socket)> end) : end_(std::move(end)) {}

  /// Adds a connection. To make room, may close idle connections, put the new connection into the reserve, or close
  /// the new connection.
  void add(Id id, int socket, std::string peer, Time now);
  void remove(Id id) { open_.erase(id); }
  /// Records that a whole request was received: the connection is not idle until `await_request` is called.
  void begin_request(Id id);
  void await_request(Id id, Time now);
  /// Returns whether the connection belongs to the reserve, which serves only vital requests: health check and metrics.
  [[nodiscard]] bool is_in_reserve(Id id) const;
  /// Closes connections that have waited for a complete request for longer than `request_time`.
  void end_incomplete_requests(Time now);

 private:
  struct Open {
    int socket = -1;
    std::string peer{};
    // time since which the connection waits for a request; `never` while a request is being answered
    Time idle_since = never;
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
