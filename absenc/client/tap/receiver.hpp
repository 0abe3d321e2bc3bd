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

/// Bytes that came at one time, or the fact that none came.
struct Received {
  Time at{};
  std::vector<std::uint8_t> bytes{};  // none: nothing has come for `Receiver::quiet`
};

class Receiver {
 public:
  enum class End : std::uint8_t { none, input, time, interrupted, lost };

  /// A port of the address. Throws os::Failure, UsageError.
  explicit Receiver(const EncoderAddress& uri);
  /// Raw bytes from standard input.
  Receiver();
  ~Receiver();
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  /// From now on, until this time. Once.
  void start(Time end = never);
  /// The next, in order; nothing at the end, or when `deadline` came first.
  [[nodiscard]] std::optional<Received> next(Time deadline = never);
  /// From any thread: `next` returns nothing from now on.
  void cancel();

  /// Why no more comes; `none` while more may.
  [[nodiscard]] End end() const;
  /// In words, where the port was lost.
  [[nodiscard]] std::string problem() const;
  /// Bytes that were dropped, because whoever takes them was too slow for too long.
  [[nodiscard]] std::uint64_t dropped() const;

  /// "/dev/ttyUSB0 at 2500000 baud"
  [[nodiscard]] const std::string& place() const { return place_; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return link_.notes; }
  /// How late a byte may come to this program.
  [[nodiscard]] Time latency() const { return link_.latency; }
  /// So long a silence is in no frame, and before no reply.
  [[nodiscard]] Time quiet() const;

 private:
  static constexpr std::size_t most_waiting = 64 << 20;  // bytes

  void receive();
  void receive_from_port();
  void receive_from_input();
  void put(Received received);
  void finish(End end, const std::string& problem = {});

  Link link_;
  std::string place_;
  Time end_time_ = never;

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<Received> waiting_;
  std::size_t waiting_size_ = 0;
  std::uint64_t dropped_ = 0;
  End end_ = End::none;
  std::string problem_;
  bool cancelled_ = false;

  std::function<bool()> is_over_;
  std::jthread thread_;  // last: it uses all of the others
};

}  // namespace absenc::client
