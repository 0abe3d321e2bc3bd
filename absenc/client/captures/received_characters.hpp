// SPDX-License-Identifier: Apache-2.0
// A capture made of characters that this computer received live.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absenc/capture/files/parsed_reader.hpp"
#include "absenc/capture/signal.hpp"
#include "absenc/core/time.hpp"

namespace absenc::client {

/// Ticks per second: finer than arrival times can be measured.
inline constexpr std::uint64_t arrival_ticks_per_second = 1'000'000;

[[nodiscard]] constexpr capture::Tick arrival_tick(Time time) {
  return static_cast<capture::Tick>(time.count() / 1000);
}

struct ReceivedCharacters {
  std::vector<capture::Character> characters{};  // characters with times in arrival ticks
  // shortest pause that is taken for one of the line, not for a delay of this computer (Annotator::Settings::gap)
  capture::Tick gap = 1;
};

class ReceivedReader final : public capture::ParsedReader {
 public:
  explicit ReceivedReader(std::shared_ptr<const ReceivedCharacters> received) : received_(std::move(received)) {
    layout_.content = capture::Content::bytes;
    layout_.ticks_per_second = arrival_ticks_per_second;
    layout_.arrival_gap = received_->gap;
  }

  [[nodiscard]] bool claim(capture::Block& block) override {
    if (std::exchange(done_, true)) return false;
    capture::begin_block(block, 0, 0);
    block.bytes = received_->characters;
    block.end = block.bytes.empty() ? 0 : block.bytes.back().end;
    return true;
  }

 private:
  std::shared_ptr<const ReceivedCharacters> received_;
  bool done_ = false;
};

}  // namespace absenc::client
