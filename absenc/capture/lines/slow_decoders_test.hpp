// SPDX-License-Identifier: Apache-2.0
// Simple decoders that take one sample after the other: tests compare the fast decoders with them.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "absenc/capture/files/memory_reader_test.hpp"
#include "absenc/capture/lines/async.hpp"
#include "absenc/capture/lines/clocked.hpp"

namespace absenc::capture {

class SlowDecoder {
 public:
  SlowDecoder(Drawn levels, const AsyncFormat& format, std::uint8_t channel)
      : levels_(std::move(levels)), format_(format), channel_(channel), stop_(format.parity == Parity::none ? 9 : 10) {
    if (!format.idle_high) invert(levels_);
    if (format.glitch > 0) remove_glitches();
    length_ = static_cast<std::size_t>(std::llround(format.bit * (stop_ + format.stop_bits)));
  }

  std::vector<Character> decode() {
    std::vector<Character> found;
    if (const auto start = first_start()) run(*start, levels_.size(), &found);
    return found;
  }

 private:
  [[nodiscard]] std::size_t middle(unsigned bit) const { return static_cast<std::size_t>(format_.bit * (bit + 0.5)); }

  void remove_glitches() {
    bool level = levels_.front() != 0;
    std::optional<std::size_t> since;
    Drawn clean = levels_;
    for (std::size_t i = 0; i < levels_.size(); ++i) {
      const bool now = levels_[i] != 0;
      if (now != level && !since) since = i;
      if (now == level) since.reset();
      clean[i] = level;
      if (since && (i + 1 - *since >= format_.glitch || i + 1 == levels_.size())) {
        level = !level;
        for (std::size_t j = *since; j <= i; ++j) clean[j] = level;
        since.reset();
      }
    }
    levels_ = clean;
  }

  [[nodiscard]] std::optional<std::size_t> falling(std::size_t from) const {
    for (std::size_t i = std::max<std::size_t>(from, 1); i < levels_.size(); ++i) {
      if (levels_[i - 1] && !levels_[i]) return i;
    }
    return std::nullopt;
  }

  // Decodes characters from the falling edge at the tick `from` on. Returns the number of faults.
  std::size_t run(std::size_t from, std::size_t limit, std::vector<Character>* found) const {
    std::size_t faults = 0;
    for (std::optional<std::size_t> start = from; start && *start + middle(stop_) < limit;) {
      if (levels_[*start + middle(0)]) {
        ++faults;
        start = falling(*start + 1);
        continue;
      }
      Character made{.begin = *start, .channel = channel_, .is_break = true};
      bool odd = false;
      for (unsigned bit = 1; bit <= stop_; ++bit) {
        const bool level = levels_[*start + middle(bit)] != 0;
        made.is_break = made.is_break && !level;
        if (bit <= 8 && level) made.value = static_cast<std::uint8_t>(made.value | 1u << (bit - 1));
        if (bit < stop_) odd = odd != level;
        if (bit == stop_) made.bad_stop = !level;
      }
      made.bad_parity = format_.parity != Parity::none && odd != (format_.parity == Parity::odd);
      const auto next = falling(*start + middle(stop_) + 1);
      made.end = std::min({*start + length_, next.value_or(levels_.size()), levels_.size()});
      faults += made.bad_stop || made.bad_parity ? 1 : 0;
      if (found != nullptr) found->push_back(made);
      start = next;
    }
    return faults;
  }

  [[nodiscard]] std::optional<std::size_t> first_start() const {
    const auto first = falling(0);
    if (!first) return std::nullopt;
    std::size_t high = *first;
    while (high > 0 && levels_[high - 1]) --high;
    if (*first - high >= length_) return first;
    const std::size_t limit = std::min(levels_.size(), *first + 12 * length_);
    std::size_t best = *first;
    std::size_t fewest = run(best, limit, nullptr);
    unsigned tried = 1;
    for (auto next = falling(best + 1); next && *next - *first <= length_ && tried < 16; next = falling(*next + 1)) {
      ++tried;
      const std::size_t faults = run(*next, limit, nullptr);
      if (faults < fewest) {
        best = *next;
        fewest = faults;
      }
    }
    return best;
  }

  Drawn levels_;
  AsyncFormat format_;
  std::uint8_t channel_;
  unsigned stop_;
  std::size_t length_ = 0;
};

struct SlowClocked {
  const std::vector<Drawn>& levels;  // levels of the wires clock, in, out and select, in this order
  ClockedFormat format;
  std::vector<Burst> found{};
  Burst burst{};
  bool open = false;
  unsigned edges = 0;
  bool fell = false;

  void end(Tick at, bool cut) {
    burst.end = at;
    burst.cut = burst.cut || cut;
    burst.low_after = !format.has_select && levels[0][at] == 0;
    const bool is_lone = !format.has_select && edges == 1;
    if (format.settle != 0 && at + format.settle <= levels[1].size()) {
      burst.last = levels[1][at + format.settle - 1] != 0;
    }
    if (open) fell = is_lone && (fell || burst.low_after);
    if (open && burst.bits > 0 && !is_lone) found.push_back(burst);
    open = false;
  }
  void begin(Tick at, bool cut) {
    burst = {};
    burst.begin = at;
    burst.cut = cut;
    burst.fell_before = fell;
    burst.low_before = !format.has_select && at > 0 && levels[0][at - 1] == 0;
    edges = 0;
    open = true;
  }
  void bit(std::size_t i) {
    const auto add = [&](std::vector<std::uint8_t>& bytes, bool level) {
      bytes.resize(burst.bits / 8 + 1);
      if (level) bytes.back() = static_cast<std::uint8_t>(bytes.back() | 1u << (7 - burst.bits % 8));
    };
    add(burst.in, levels[1][i - 1] != 0);
    add(burst.out, levels[2][i - 1] != 0);
    ++burst.bits;
  }
  // Returns whether the data line changes from `settle` ticks after `last` to the tick `until`.
  bool changes(Tick last, Tick until) const {
    for (Tick i = std::max<Tick>(last + format.settle, 1); i <= until && i < levels[1].size(); ++i) {
      if (levels[1][i] != levels[1][i - 1]) return true;
    }
    return false;
  }
  bool is_over(Tick last, Tick now) const {
    if (now - last > format.pause) return true;
    return format.change_pause != 0 && now - last > format.change_pause && changes(last, now);
  }
  std::vector<Burst> decode() {
    Tick last = 0;
    bool paused = false;
    if (format.has_select && (levels[3][0] != 0) == format.select_high) begin(0, true);
    for (std::size_t i = 1; i < levels[0].size(); ++i) {
      if (!format.has_select && is_over(last, i)) {
        end(last, false);
        paused = true;
      }
      if (levels[0][i] != levels[0][i - 1]) {
        if (!format.has_select && !open) begin(i, !paused);
        ++edges;
        if (open && (levels[0][i] != 0) == format.rising) bit(i);
        last = i;
      }
      if (format.has_select && levels[3][i] != levels[3][i - 1]) {
        if ((levels[3][i] != 0) == format.select_high)
          begin(i, false);
        else
          end(i, false);
      }
    }
    if (!format.has_select && is_over(last, levels[0].size())) end(last, false);
    end(last, true);
    return found;
  }
};

}  // namespace absenc::capture
