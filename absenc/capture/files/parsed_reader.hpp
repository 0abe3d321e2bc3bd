// SPDX-License-Identifier: Apache-2.0
// Common parts of the readers of capture files.
#pragma once

#include <algorithm>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// A list of a file's damages, in the order of the file. Several threads may add to the list.
class Damages {
 public:
  void add(Damage damage) {
    const std::lock_guard lock(mutex_);
    const auto behind = std::upper_bound(list_.begin(), list_.end(), damage,
                                         [](const Damage& a, const Damage& b) { return a.offset < b.offset; });
    list_.insert(behind, std::move(damage));
  }
  [[nodiscard]] const std::vector<Damage>& list() const { return list_; }

 private:
  std::mutex mutex_;
  std::vector<Damage> list_;
};

/// An event in a file that may occur often, reported once with its count and first place.
struct Occurrences {
  std::uint64_t count = 0;
  std::uint64_t offset = 0;
  Tick tick = 0;

  void add(std::uint64_t at_offset, Tick at) {
    if (count++ != 0) return;
    offset = at_offset;
    tick = at;
  }
  void report(Damages& damages, const std::string& what) const {
    if (count == 0) return;
    damages.add({.offset = offset, .tick = tick, .what = std::to_string(count) + " " + what, .note = true});
  }
};

/// A reader that does all its work in `claim`, which one thread at a time calls.
class ParsedReader : public Reader {
 public:
  [[nodiscard]] const Layout& layout() const override { return layout_; }
  void fill(Block&) override {}
  [[nodiscard]] const std::vector<Damage>& damages() const override { return damages_.list(); }

 protected:
  Layout layout_;
  Damages damages_;
};

/// Prepares a block for reuse; keeps the storage of its samples, and the levels before its changes.
inline void begin_block(Block& block, std::uint64_t index, Tick first) {
  block.index = index;
  block.first = first;
  block.end = first;
  for (Changes& changes : block.changes) changes.at.clear();
  block.bytes.clear();
  block.frames.clear();
  block.file_offset = 0;
  block.file_size = 0;
}

}  // namespace absenc::capture
