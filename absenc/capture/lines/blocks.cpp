// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/lines/blocks.hpp"

#include <algorithm>

#include "absenc/capture/lines/edges.hpp"

namespace absenc::capture {

std::string LevelReader::name(unsigned channel) const {
  const std::vector<std::string>& names = layout().channels;
  return channel < names.size() ? names[channel] : std::to_string(channel);
}

std::string LevelReader::problem() const {
  if (layout().content != Content::samples && layout().content != Content::changes) {
    return "the file does not hold levels of lines, but what another program made of them: decode it without a line";
  }
  for (const unsigned channel : channels_) {
    if (channel < layout().channels.size()) continue;
    return "there is no channel " + std::to_string(channel) + ": the file has " +
           std::to_string(layout().channels.size()) + " channels, counted from 0";
  }
  return {};
}

void LevelReader::expand(Block& block, Levels& levels) const {
  reader_.fill(block);
  levels.changes.resize(channels_.size());
  levels.first = block.first;
  levels.end = block.end;
  if (layout().content == Content::changes) {
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      const auto same = std::find(channels_.begin(), channels_.end(), channels_[i]) - channels_.begin();
      if (static_cast<std::size_t>(same) == i) {
        // the changes are swapped and not copied, so that both vectors keep their storage
        std::swap(levels.changes[i], block.changes[channels_[i]]);
      } else {
        levels.changes[i] = levels.changes[static_cast<std::size_t>(same)];
      }
    }
    return;
  }
  const std::size_t count = sample_count(block);
  levels.end = block.first + count;
  // `before` is the level of the block's own first sample; the caller, which joins the parts, compares it with the
  // level at the end of the previous block.
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    levels.changes[i].before = count > 0 && level_at(block, 0, channels_[i]);
  }
  find_changes(block, channels_, levels.changes);
}

}  // namespace absenc::capture
