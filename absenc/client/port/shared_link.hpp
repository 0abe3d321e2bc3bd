// SPDX-License-Identifier: Apache-2.0
// One open port for all encoders on one line, and whose turn it is to have the line.
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

/// A lock that is given in the order in which it was asked for: a mutex goes to whoever has just had it, and the others
/// would wait without end.
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

/// Whoever converses has the line for himself. A cycle of all encoders in one machine would be faster on a wire, but
/// would know one protocol; with turns each keeps its own thread, session and statistics, and a silent one costs the
/// others its time and nothing else.
class SharedLink {
 public:
  explicit SharedLink(Link link) : link_(std::move(link)) {}

  /// Does one conversation while nobody else has the line. When it loses the port, so have all: the port is closed, and
  /// each gets the os::Failure at its next turn.
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

  /// Whoever connects now needs a new one.
  [[nodiscard]] bool lost() const;

  [[nodiscard]] const Link& link() const { return link_; }

  /// What is known of late replies on this line; to be used in one's turn.
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
  // Not the exception itself: threads must not share one.
  struct Loss {
    os::Failure::Kind kind;
    std::string sentence;
  };
  mutable std::mutex mutex_;  // guards the loss against those who have no turn
  std::optional<Loss> loss_;
};

/// Whether both are on one line. Throws UsageError when they are, but need other settings of it.
[[nodiscard]] bool share_line(const EncoderAddress& one, const EncoderAddress& other);

/// For encoders that are read at the same time. Throws UsageError when two of them are one encoder, or cannot share
/// their line.
void require_different(std::span<const EncoderAddress> encoders, std::span<const std::string> names);

/// The link to this encoder: that of an encoder on the same line, if there is one and it is not lost. Throws
/// os::Failure, UsageError.
[[nodiscard]] std::shared_ptr<SharedLink> connect_link(const EncoderAddress& uri, const OpenLink& open = open_link);

}  // namespace absenc::client
