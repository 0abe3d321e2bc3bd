// SPDX-License-Identifier: Apache-2.0
// Levels as a file tells them, one channel and time after the other, into the level changes of a block.
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

  /// Before the first change: the level the channel begins with.
  void start(std::size_t channel, bool level) {
    levels_[channel] = level ? 1 : 0;
    block_->changes[channel].before = level;
  }

  /// Times must not fall; what goes back to its level at the same time did not change.
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

  /// Of the present block.
  [[nodiscard]] std::size_t changes() const { return changes_; }

 private:
  std::vector<std::uint8_t> levels_;
  std::size_t changes_ = 0;
  Block* block_ = nullptr;
};

}  // namespace absenc::capture
