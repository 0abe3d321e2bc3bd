// SPDX-License-Identifier: Apache-2.0
// Counts the discarded frames of a stream.
#pragma once

#include <cstddef>
#include <cstdint>

namespace absenc {

/// Estimates the number of discarded frames from the number of bytes that belong to no valid frame.
class DiscardedFrames {
 public:
  /// Counts frames with a length of `frame_bytes` bytes.
  explicit constexpr DiscardedFrames(std::size_t frame_bytes) : frame_bytes_(frame_bytes) {}

  /// Notes that `bytes` received bytes belong to no valid frame.
  constexpr void skip(std::size_t bytes) {
    skipped_ += bytes;
    gap_ += bytes;
  }
  /// Notes that a valid frame begins after the bytes noted so far.
  constexpr void found() {
    before_ = count();
    begun_ = true;
    gap_ = 0;
  }
  /// Returns the estimated number of discarded frames so far.
  [[nodiscard]] constexpr std::uint64_t count() const {
    return before_ + (gap_ + (begun_ ? frame_bytes_ - 1 : 0)) / frame_bytes_;
  }
  /// Returns the number of bytes that belong to no valid frame.
  [[nodiscard]] constexpr std::uint64_t skipped() const { return skipped_; }

 private:
  std::size_t frame_bytes_;
  bool begun_ = false;
  std::uint64_t skipped_ = 0;
  std::uint64_t before_ = 0;  // estimated number of discarded frames before the last valid frame
  std::uint64_t gap_ = 0;     // bytes skipped after the last valid frame, or since the start
};

}  // namespace absenc
