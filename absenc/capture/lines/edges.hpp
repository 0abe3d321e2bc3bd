// SPDX-License-Identifier: Apache-2.0
// Converts samples to level changes, with the vector instructions of the processor.
#pragma once

#include <cstddef>
#include <span>

#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns the number of whole samples in a block.
[[nodiscard]] inline std::size_t sample_count(const Block& block) {
  return block.samples.size() / block.bytes_per_sample;
}

/// Returns the level of `channel` in the sample at `index`; both must exist.
[[nodiscard]] inline bool level_at(const Block& block, std::size_t index, unsigned channel) {
  return (block.samples[index * block.bytes_per_sample + channel / 8] >> channel % 8 & 1) != 0;
}

/// Sets `changes[i].at` for `channels[i]`; `changes[i].before` must be the level before the block.
void find_changes(const Block& block, std::span<const unsigned> channels, std::span<Changes> changes);

/// A function like `find_changes` that uses the instructions of one set; for at most 64 channels, and it adds to
/// `changes[i].at`.
using ChangeFinder = void (*)(const Block& block, std::span<const unsigned> channels, std::span<Changes> changes);
/// Returns these functions for the instruction sets that this processor has, the fastest first; at least one.
[[nodiscard]] std::span<const ChangeFinder> change_finders();

/// Returns the level after the last of `changes`, or the level before them if there is none.
[[nodiscard]] inline bool level_after(const Changes& changes) { return changes.before != (changes.at.size() % 2 != 0); }

/// Appends the changes of the next part of a capture, which begins at the tick `first`; its first level may differ from
/// the last level of `changes`.
void append(Changes& changes, const Changes& next, Tick first);

}  // namespace absenc::capture
