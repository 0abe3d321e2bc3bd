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
#include "absenc/host/reply_guard.hpp"
#include "absenc/os/error.hpp"

namespace absenc::client {

/// A fair lock, granted in the order of requests. With a mutex, the thread that has just released it would often get it
/// again, and the other threads would starve.
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

/// An open port, which several encoders can share: only one conversation uses the line at a time.
class SharedLink {
 public:
  explicit SharedLink(Link link) : link_(std::move(link)) {}

  /// Runs `work`, one conversation, with exclusive use of the line, and returns its result. If `work` throws an
  /// os::Failure, the port counts as lost: it is closed, and every later call throws an os::Failure of the same kind
  /// and text.
  template <class Work>
  auto take_turn(const Work& work) {
    const std::lock_guard turn(turns_);
    if (loss_) throw os::Failure(loss_->kind, loss_->sentence);
    try {
      return work();
    } catch (const os::Failure& failure) {
      lose(failure);
      throw;
    }
  }

  /// Returns whether the port was lost, so that users need a new link.
  [[nodiscard]] bool lost() const;

  [[nodiscard]] const Link& link() const { return link_; }

  /// Returns the state of late replies on this line. Only a conversation that has the line may use it.
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
  // The data of the exception that reported the loss, because threads must not share an exception object.
  struct Loss {
    os::Failure::Kind kind;
    std::string sentence;
  };
  mutable std::mutex mutex_;  // guards `loss_`, which other threads read without a turn
  std::optional<Loss> loss_;
};

/// Returns whether both encoders are on the same line; false for SPI and sim:, whose ports are not shared. Throws
/// UsageError if they are on the same line, but need different settings of it.
[[nodiscard]] bool share_line(const EncoderAddress& one, const EncoderAddress& other);

/// Checks that encoders can be read at the same time. Throws UsageError if two are the same encoder or on the same SPI
/// device, or cannot share a line.
void require_different(std::span<const EncoderAddress> encoders, std::span<const std::string> names);

/// Returns a link to the encoder: the open link of the same line if there is one, otherwise a new one. Throws
/// os::Failure, UsageError.
[[nodiscard]] std::shared_ptr<SharedLink> connect_link(const EncoderAddress& uri, const OpenLink& open = open_link);

}  // namespace absenc::client
