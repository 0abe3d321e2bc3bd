// SPDX-License-Identifier: Apache-2.0
// Converts levels that a file lists by channel and time to the level changes of a block.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absenc/capture/signal.hpp"

namespace absenc::capture {

class LevelWriter {
 public:
  explicit LevelWriter(std::size_t channels) : levels_(channels) {}

  void begin(Block& block) {
    block_ = &block;
    changes_ = 0;
    block.changes.resize(levels_.size());
    for (std::size_t i = 0; i < levels_.size(); ++i) block.changes[i].before = levels_[i] != 0;
  }

  /// Sets the initial level of a channel; call it before its first change.
  void start(std::size_t channel, bool level) {
    levels_[channel] = level ? 1 : 0;
    block_->changes[channel].before = level;
  }

  /// Sets the level of a channel at the time `at`. Times must not decrease.
  void set(std::size_t channel, bool level, Tick at) {
    if ((levels_[channel] != 0) == level) return;
    levels_[channel] = level ? 1 : 0;
    ++changes_;
    std::vector<Tick>& times = block_->changes[channel].at;
    if (!times.empty() && times.back() == at) {
      times.pop_back();
    } else {
      times.push_back(at);
    }
  }

  /// Returns the number of level changes in the present block, including those that cancelled each other.
  [[nodiscard]] std::size_t changes() const { return changes_; }

 private:
  std::vector<std::uint8_t> levels_;
  std::size_t changes_ = 0;
  Block* block_ = nullptr;
};

}  // namespace absenc::capture
