// SPDX-License-Identifier: Apache-2.0
// Converts samples to level changes, with the widest vector instructions that the processor has.
#pragma once

#include <cstddef>
#include <span>

#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns the number of whole samples in a block.
[[nodiscard]] inline std::size_t sample_count(const Block& block) {
  return block.samples.size() / block.bytes_per_sample;
}

/// Returns the level of `channel` (below 8 * bytes_per_sample) in the sample at `index`, which must exist.
[[nodiscard]] inline bool level_at(const Block& block, std::size_t index, unsigned channel) {
  return (block.samples[index * block.bytes_per_sample + channel / 8] >> channel % 8 & 1) != 0;
}

/// Replaces `changes[i].at` by the changes of `channels[i]` in a block of samples. `changes[i].before` must be the
/// level before the block: for consecutive blocks, the level after the last change of the previous block.
void find_changes(const Block& block, std::span<const unsigned> channels, std::span<Changes> changes);

/// Returns the level after the last change; without changes the level before them.
[[nodiscard]] inline bool level_after(const Changes& changes) { return changes.before != (changes.at.size() % 2 != 0); }

/// Appends the changes of `next`, a part that begins at `first`. If its first level differs from the last level in
/// `changes`, the line changed at `first`.
void append(Changes& changes, const Changes& next, Tick first);

}  // namespace absenc::capture
