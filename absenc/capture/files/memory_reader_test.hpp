// SPDX-License-Identifier: Apache-2.0
// A reader for tests: a capture in memory, read as samples or as changes in blocks of any size.
#pragma once

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absenc/capture/signal.hpp"
#include "absenc/link/line.hpp"

namespace absenc::capture {

using Random = std::mt19937_64;

inline std::uint64_t below(Random& random, std::uint64_t limit) {
  return std::uniform_int_distribution<std::uint64_t>(0, limit - 1)(random);
}

/// The levels of one channel, 0 or 1 for each tick. It is no std::vector<bool>, which is slow without optimisation.
using Drawn = std::vector<std::uint8_t>;

inline void invert(Drawn& levels) {
  for (std::uint8_t& level : levels) level ^= 1;
}

/// Levels of several channels at the same ticks.
struct Wires {
  std::vector<Drawn> levels;
  std::uint64_t ticks_per_second = 1'000'000'000;

  [[nodiscard]] std::size_t ticks() const { return levels.front().size(); }
};

/// Returns the level changes of the samples `first` to `end` - 1; `before`: level of the sample before them.
inline Changes changes_of(const Drawn& levels, bool before, std::size_t first, std::size_t end) {
  Changes found{before, {}};
  bool level = before;
  for (std::size_t i = first; i < end; ++i) {
    if ((levels[i] != 0) != level) found.at.push_back(i);
    level = levels[i] != 0;
  }
  return found;
}

class MemoryReader final : public Reader {
 public:
  /// Makes a reader that returns blocks of random sizes up to `most` ticks. Ticks that are given to `leave_out` are in
  /// no block, like a gap in a capture.
  MemoryReader(const Wires& wires, Content content, std::size_t most, std::uint64_t seed)
      : wires_(wires), most_(most), random_(seed) {
    layout_.content = content;
    layout_.ticks_per_second = wires.ticks_per_second;
    for (std::size_t i = 0; i < wires.levels.size(); ++i) layout_.channels.push_back("D" + std::to_string(i));
    for (const Drawn& levels : wires.levels) silent_.push_back(std::count(levels.begin(), levels.end(), 1) == 0);
    while (bytes_per_sample_ * 8 < wires.levels.size()) bytes_per_sample_ *= 2;
  }
  void leave_out(std::size_t first, std::size_t end) {
    hole_first_ = first;
    hole_end_ = end;
  }
  void widen(unsigned bytes_per_sample) { bytes_per_sample_ = bytes_per_sample; }

  [[nodiscard]] const Layout& layout() const override { return layout_; }
  [[nodiscard]] bool claim(Block& block) override {
    if (next_ == hole_first_ && hole_end_ > hole_first_) next_ = hole_end_;
    if (next_ >= wires_.ticks()) return false;
    block.index = index_++;
    block.first = next_;
    auto end = static_cast<std::size_t>(std::min<std::uint64_t>(next_ + 1 + below(random_, most_), wires_.ticks()));
    if (next_ < hole_first_) end = std::min(end, hole_first_);
    block.end = next_ = end;
    return true;
  }
  void fill(Block& block) override {
    const auto first = static_cast<std::size_t>(block.first);
    const auto end = static_cast<std::size_t>(block.end);
    if (layout_.content == Content::changes) {
      block.changes.clear();
      for (const auto& levels : wires_.levels) {
        block.changes.push_back(changes_of(levels, levels[first == 0 ? 0 : first - 1] != 0, first, end));
      }
      return;
    }
    block.bytes_per_sample = bytes_per_sample_;
    block.samples.assign((end - first) * bytes_per_sample_, 0);
    for (std::size_t channel = 0; channel < wires_.levels.size(); ++channel) {
      if (silent_[channel]) continue;
      const std::uint8_t* const level = wires_.levels[channel].data();
      std::uint8_t* byte = block.samples.data() + channel / 8;
      for (std::size_t i = first; i < end; ++i, byte += bytes_per_sample_) {
        *byte = static_cast<std::uint8_t>(*byte | level[i] << channel % 8);
      }
    }
  }
  [[nodiscard]] const std::vector<Damage>& damages() const override { return damages_; }

 private:
  const Wires& wires_;
  std::size_t most_;
  std::vector<bool> silent_;
  Random random_;
  Layout layout_;
  unsigned bytes_per_sample_ = 1;
  std::size_t next_ = 0;
  std::size_t hole_first_ = 0;
  std::size_t hole_end_ = 0;
  std::uint64_t index_ = 0;
  std::vector<Damage> damages_;
};

/// Draws the levels of an asynchronous line, tick by tick; an idle line is high.
class Pen {
 public:
  Pen(double bit, Parity parity, unsigned stop_bits, unsigned data_bits = 8)
      : bit_(bit), parity_(parity), stop_bits_(stop_bits), data_bits_(data_bits) {}

  void hold(bool level, double bits) {
    at_ += bits * bit_;
    levels.resize(std::max(levels.size(), static_cast<std::size_t>(at_)), level);
  }
  void character(unsigned value, bool good_parity = true, bool good_stop = true) {
    hold(false, 1);
    bool odd = false;
    for (unsigned i = 0; i < data_bits_; ++i) {
      const bool level = (value >> i & 1) != 0;
      odd = odd != level;
      hold(level, 1);
    }
    if (parity_ != Parity::none) hold((odd != (parity_ == Parity::odd)) == good_parity, 1);
    hold(good_stop, stop_bits_);
  }

  Drawn levels;

 private:
  double bit_;
  Parity parity_;
  unsigned stop_bits_;
  unsigned data_bits_;
  double at_ = 0;
};

}  // namespace absenc::capture
