// SPDX-License-Identifier: Apache-2.0
// What readers share: their layout, and what was wrong. Text is parsed when it is claimed, because each part depends on
// the one before.
#pragma once

#include <algorithm>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Damages in the order of the file; several threads may add to them.
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

/// A thing that may happen often and is reported once, with the place of the first.
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

/// A reader whose `claim` does it all, in one thread. Of the processor time of `decode --stats`, parsing is 63 to 78 %
/// for dumps, 66 to 97 % for CSV: decoding beside it hides the rest. Several parsers would have to settle levels, times
/// and damages between their parts in order; a faster one brought more than a second core could.
class ParsedReader : public Reader {
 public:
  [[nodiscard]] const Layout& layout() const override { return layout_; }
  void fill(Block&) override {}
  [[nodiscard]] const std::vector<Damage>& damages() const override { return damages_.list(); }

 protected:
  Layout layout_;
  Damages damages_;
};

/// Empties a block for what its next part holds, but for samples, whose storage is to be used again as it is.
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
