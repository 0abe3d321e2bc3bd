// SPDX-License-Identifier: Apache-2.0
// A run: consecutive characters of one channel without a pause between them; of bytes with arrival times, all that are
// not parsed yet.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/capture/signal.hpp"
#include "absenc/core/bytes.hpp"

namespace absenc::capture {

class Run {
 public:
  static constexpr std::size_t capacity = 512;

  void push(const Character& character) {
    const bool damaged = character.bad_parity || character.bad_stop || character.is_break;
    bytes_[size_] = character.value;
    begins_[size_] = character.begin;
    ends_[size_] = character.end;
    damaged_[size_] = damaged;
    damages_ += damaged ? 1 : 0;
    ++size_;
  }

  /// Removes the first `count` characters of the run.
  void drop(std::size_t count) {
    const auto keep = [&](auto& items) {
      std::copy(items.begin() + static_cast<std::ptrdiff_t>(count), items.begin() + static_cast<std::ptrdiff_t>(size_),
                items.begin());
    };
    if (count < size_) {
      keep(bytes_);
      keep(begins_);
      keep(ends_);
      keep(damaged_);
    }
    size_ -= count;
    damages_ = static_cast<std::size_t>(
        std::count(damaged_.begin(), damaged_.begin() + static_cast<std::ptrdiff_t>(size_), true));
  }
  void clear() { size_ = damages_ = 0; }

  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] bool full() const { return size_ == capacity; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] Bytes bytes() const { return {bytes_.data(), size_}; }
  [[nodiscard]] Tick begin(std::size_t index) const { return begins_[index]; }
  [[nodiscard]] Tick end(std::size_t index) const { return ends_[index]; }
  [[nodiscard]] Tick end() const { return ends_[size_ - 1]; }

  /// Returns whether none of the `count` characters of the run from index `first` on is damaged.
  [[nodiscard]] bool clean(std::size_t first, std::size_t count) const {
    if (damages_ == 0) return true;
    const auto from = damaged_.begin() + static_cast<std::ptrdiff_t>(first);
    return std::find(from, from + static_cast<std::ptrdiff_t>(count), true) ==
           from + static_cast<std::ptrdiff_t>(count);
  }

 private:
  std::array<std::uint8_t, capacity> bytes_{};
  std::array<Tick, capacity> begins_{};
  std::array<Tick, capacity> ends_{};
  std::array<bool, capacity> damaged_{};
  std::size_t size_ = 0;
  std::size_t damages_ = 0;
};

}  // namespace absenc::capture
