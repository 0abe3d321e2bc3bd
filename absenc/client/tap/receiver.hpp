// SPDX-License-Identifier: Apache-2.0
// Receives bytes in a thread of its own; sends nothing.
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

/// Bytes that arrived at one time, or the report that no byte arrived.
struct Received {
  Time at{};
  std::vector<std::uint8_t> bytes{};  // received bytes; empty: no byte has arrived for the time `Receiver::quiet`
};

class Receiver {
 public:
  enum class ReceiveEnd : std::uint8_t { none, input, time, interrupted, lost };

  /// Opens the port of the address for receiving. Throws os::Failure, UsageError, Failure.
  explicit Receiver(const EncoderAddress& uri);
  /// Receives raw bytes from standard input.
  Receiver();
  ~Receiver();
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  /// Starts the receiving thread, which ends at the time `end` at the latest. Called once.
  void start(Time end = never);
  /// Waits for bytes or silence and returns them; nothing at `deadline` or at the end.
  [[nodiscard]] std::optional<Received> next(Time deadline = never);
  /// Ends receiving: `next` returns nothing from now on. May be called from any thread.
  void cancel();

  /// Returns why receiving ended; `none` while it continues.
  [[nodiscard]] ReceiveEnd end() const;
  /// Returns a sentence about the loss of the port; "" if it was not lost.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] std::uint64_t dropped() const;

  /// Returns the port in words, "/dev/ttyUSB0 at 2500000 baud".
  [[nodiscard]] const std::string& place() const { return place_; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return link_.notes; }
  /// Returns the configured or assumed greatest delay of a byte on its way to this program.
  [[nodiscard]] Time latency() const { return link_.latency; }
  /// Returns a time of silence that is assumed to occur neither inside a frame nor before a reply.
  [[nodiscard]] Time quiet() const;

 private:
  // greatest number of bytes that may wait until the caller takes them
  static constexpr std::size_t most_waiting = 64 << 20;

  void receive();
  void receive_from_port();
  void receive_from_input();
  void put(Received received);
  void finish(ReceiveEnd end, const std::string& problem = {});

  Link link_;
  std::string place_;
  Time end_time_ = never;

  mutable std::mutex mutex_;  // guards the members from `changed_` to `cancelled_`, which two threads use
  std::condition_variable changed_;
  std::deque<Received> waiting_;
  std::size_t waiting_size_ = 0;
  std::uint64_t dropped_ = 0;
  ReceiveEnd end_ = ReceiveEnd::none;
  std::string problem_;
  bool cancelled_ = false;

  std::function<bool()> is_over_;
  std::jthread thread_;  // declared last, because the thread uses all other members of this object
};

}  // namespace absenc::client
