// SPDX-License-Identifier: Apache-2.0
// Shares one open port between all encoders on a line, whose conversations take turns.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

#include "absenc/client/port/link.hpp"
#include "absenc/client/port/realtime.hpp"
#include "absenc/host/reply_guard.hpp"
#include "absenc/os/error.hpp"

namespace absenc::client {

/// A fair lock, granted in the order of requests.
class Turns {
 public:
  void lock() {
    std::unique_lock lock(mutex_);
    const std::uint64_t ticket = tickets_++;
    changed_.wait(lock, [&] { return ticket == current_; });
  }
  void unlock() {
    {
      const std::lock_guard lock(mutex_);
      ++current_;
    }
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t tickets_ = 0;
  std::uint64_t current_ = 0;
};

class SharedLink {
 public:
  explicit SharedLink(Link link) : link_(std::move(link)) {}

  /// Runs `work` with exclusive use of the line. An os::Failure of `work` closes the port. Throws Failure if the port
  /// needs a real-time thread and the kernel refuses.
  template <class Work>
  auto take_turn(const Work& work) {
    require_realtime(link_.realtime);
    const std::lock_guard turn(turns_);
    if (loss_) throw os::Failure(loss_->kind, loss_->sentence);
    try {
      return work();
    } catch (const os::Failure& failure) {
      lose(failure);
      throw;
    }
  }

  /// Returns whether the port was lost, so that its users must connect again.
  [[nodiscard]] bool lost() const;

  [[nodiscard]] const Link& link() const { return link_; }

  /// Returns the guard against late replies, which only a conversation that has its turn on the line may use.
  template <class Item>
  [[nodiscard]] host::ReplyGuard<Item>& guard() {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      return frame_guard_;
    } else {
      return byte_guard_;
    }
  }

 private:
  void lose(const os::Failure& failure);

  Link link_;
  host::ReplyGuard<std::uint8_t> byte_guard_;
  host::ReplyGuard<CanFrame> frame_guard_;
  Turns turns_;
  // The loss of the port as data, because threads must not share an exception object.
  struct Loss {
    os::Failure::Kind kind;
    std::string sentence;
  };
  mutable std::mutex mutex_;  // guards `loss_`, which other threads read while a conversation uses the line
  std::optional<Loss> loss_;
};

/// Returns whether both encoders are on one line; always false on SPI and for virtual encoders. Throws UsageError if
/// they are, but their line settings differ.
[[nodiscard]] bool share_line(const EncoderAddress& one, const EncoderAddress& other);

/// Checks that all these encoders can be read at the same time. Throws UsageError if not.
void require_different(std::span<const EncoderAddress> encoders, std::span<const std::string> names);

/// Returns the link that is already open for the line of this address, or opens a new one. Throws os::Failure,
/// UsageError, Failure.
[[nodiscard]] std::shared_ptr<SharedLink> connect_link(const EncoderAddress& uri, const OpenLink& open = open_link);

}  // namespace absenc::client
