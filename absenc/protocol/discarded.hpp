// SPDX-License-Identifier: Apache-2.0
// How many frames of a stream were discarded, by the bytes in which no good one was found.
#pragma once

#include <cstddef>
#include <cstdint>

namespace absenc {

/// Counts as many frames as would fit between two good ones. Less than one before the first good frame is none: it may
/// have been under way before anybody listened.
class DiscardedFrames {
 public:
  /// Counts frames of this length.
  explicit constexpr DiscardedFrames(std::size_t frame_bytes) : frame_bytes_(frame_bytes) {}

  /// Notes bytes that belong to no frame.
  constexpr void skip(std::size_t bytes) {
    skipped_ += bytes;
    gap_ += bytes;
  }
  /// A good frame begins here.
  constexpr void found() {
    before_ = count();
    begun_ = true;
    gap_ = 0;
  }
  /// Returns the number of frames that were damaged.
  [[nodiscard]] constexpr std::uint64_t count() const {
    return before_ + (gap_ + (begun_ ? frame_bytes_ - 1 : 0)) / frame_bytes_;
  }
  /// Bytes.
  [[nodiscard]] constexpr std::uint64_t skipped() const { return skipped_; }

 private:
  std::size_t frame_bytes_;
  bool begun_ = false;
  std::uint64_t skipped_ = 0;
  std::uint64_t before_ = 0;  // up to the last good frame
  std::uint64_t gap_ = 0;     // bytes skipped since then
};

}  // namespace absenc
