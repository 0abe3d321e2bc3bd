// SPDX-License-Identifier: Apache-2.0
// Number of discarded frames of a stream, from the bytes in which no valid frame was found.
#pragma once

#include <cstddef>
#include <cstdint>

namespace absenc {

/// Counts as many frames as fit between two valid ones. Less than one frame before the first valid one does not count:
/// it may have begun before the host listened.
class DiscardedFrames {
 public:
  /// Counts frames of this length.
  explicit constexpr DiscardedFrames(std::size_t frame_bytes) : frame_bytes_(frame_bytes) {}

  /// Notes bytes that belong to no frame.
  constexpr void skip(std::size_t bytes) {
    skipped_ += bytes;
    gap_ += bytes;
  }
  /// A valid frame begins here.
  constexpr void found() {
    before_ = count();
    begun_ = true;
    gap_ = 0;
  }
  /// Returns the number of frames that were damaged.
  [[nodiscard]] constexpr std::uint64_t count() const {
    return before_ + (gap_ + (begun_ ? frame_bytes_ - 1 : 0)) / frame_bytes_;
  }
  /// Returns the number of skipped bytes.
  [[nodiscard]] constexpr std::uint64_t skipped() const { return skipped_; }

 private:
  std::size_t frame_bytes_;
  bool begun_ = false;
  std::uint64_t skipped_ = 0;
  std::uint64_t before_ = 0;  // discarded frames up to the last valid frame
  std::uint64_t gap_ = 0;     // bytes skipped after the last valid frame
};

}  // namespace absenc
