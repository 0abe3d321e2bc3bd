// SPDX-License-Identifier: Apache-2.0
// Receives the bytes of a port in a thread of its own, because its reader may be slow. Nothing is ever sent.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "absenc/client/port/address.hpp"
#include "absenc/client/port/link.hpp"
#include "absenc/core/time.hpp"

namespace absenc::client {

/// Bytes that arrived at one time, or the report that none arrived.
struct Received {
  Time at{};
  std::vector<std::uint8_t> bytes{};  // empty: no byte has arrived for `Receiver::quiet`
};

class Receiver {
 public:
  enum class ReceiveEnd : std::uint8_t { none, input, time, interrupted, lost };

  /// Opens the port of the address. Throws os::Failure, UsageError.
  explicit Receiver(const EncoderAddress& uri);
  /// Receives raw bytes from standard input.
  Receiver();
  ~Receiver();
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  /// Starts receiving, until `end`. Called once.
  void start(Time end = never);
  /// Returns the next bytes in order; nothing at the end, or if `deadline` is reached first.
  [[nodiscard]] std::optional<Received> next(Time deadline = never);
  /// Makes `next` return nothing from now on. May be called from any thread.
  void cancel();

  /// Returns why the port was lost; `none` while it is open.
  [[nodiscard]] ReceiveEnd end() const;
  /// Returns in words why the port was lost.
  [[nodiscard]] std::string problem() const;
  /// Returns the number of dropped bytes. Bytes are dropped if the reader is too slow for too long.
  [[nodiscard]] std::uint64_t dropped() const;

  /// Returns the place as "/dev/ttyUSB0 at 2500000 baud".
  [[nodiscard]] const std::string& place() const { return place_; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return link_.notes; }
  /// The greatest delay of a byte on its way to this program.
  [[nodiscard]] Time latency() const { return link_.latency; }
  /// A silence of this length occurs neither in a frame nor before a reply.
  [[nodiscard]] Time quiet() const;

 private:
  static constexpr std::size_t most_waiting = 64 << 20;  // limit of waiting bytes

  void receive();
  void receive_from_port();
  void receive_from_input();
  void put(Received received);
  void finish(ReceiveEnd end, const std::string& problem = {});

  Link link_;
  std::string place_;
  Time end_time_ = never;

  mutable std::mutex mutex_;  // guards the members down to the thread
  std::condition_variable changed_;
  std::deque<Received> waiting_;
  std::size_t waiting_size_ = 0;
  std::uint64_t dropped_ = 0;
  ReceiveEnd end_ = ReceiveEnd::none;
  std::string problem_;
  bool cancelled_ = false;

  std::function<bool()> is_over_;
  std::jthread thread_;  // last member: it uses all others
};

}  // namespace absenc::client
