// SPDX-License-Identifier: Apache-2.0
// Finds frames in the bytes of a streaming encoder.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/protocol/discarded.hpp"
#include "absenc/protocol/raa38/serial/frame.hpp"

namespace absenc::raa38::serial {

/// A result of the stream decoder: a valid frame, or the error that ended the alignment.
struct StreamFrame {
  Error error = Error::none;     ///< Error that ended the alignment; `none` for a valid frame.
  std::uint32_t singleturn = 0;  ///< Position in the valid frame, in counts; 0 with an error.
  Time at{};                     ///< Time at which the last byte of the valid frame was received.
};

/// Finds frames in received bytes. The decoder becomes aligned by two valid frames in a row. While aligned, it accepts
/// a frame with an FF behind its second byte only when the next frame's header follows.
class StreamDecoder {
 public:
  /// Creates a decoder for a streaming encoder of this format.
  explicit constexpr StreamDecoder(const Format& format)
      : format_(format),
        frame_(format.frame_bytes()),
        second_byte_(format.own_second_byte()),
        discarded_(format.frame_bytes()) {}

  /// Processes bytes that were received at `at`; calls `on_frame(const StreamFrame&)` for each result.
  template <class OnFrame>
  constexpr void feed(Bytes bytes, Time at, OnFrame&& on_frame) {
    for (const std::uint8_t byte : bytes) {
      window_[size_] = byte;
      times_[size_++] = at;
      while (in_step_ ? follow(on_frame) : search(on_frame)) {
      }
    }
  }

  /// Processes a damaged character, which ends the alignment.
  template <class OnFrame>
  constexpr void disturbed(OnFrame&& on_frame) {
    discarded_.skip(size_ + 1);
    size_ = 0;
    if (!in_step_) return;
    in_step_ = false;
    bad_.clear();
    on_frame(StreamFrame{.error = Error::bad_framing});
  }

  /// Returns whether the decoder is aligned: the next frame must begin where the last one ended.
  [[nodiscard]] constexpr bool in_step() const { return in_step_; }
  /// Returns the number of received bytes that belong to no frame.
  [[nodiscard]] constexpr std::uint64_t skipped() const { return discarded_.skipped(); }
  /// Returns the number of discarded frames, which DiscardedFrames computes from the skipped bytes.
  [[nodiscard]] constexpr std::uint64_t discarded() const { return discarded_.count(); }
  /// Returns whether a frame was valid except for a position with more bits than the format has.
  [[nodiscard]] constexpr bool saw_larger_positions() const { return saw_larger_positions_; }
  /// Returns the bytes of the last frame that ended the alignment; may be empty.
  [[nodiscard]] constexpr Bytes bad() const { return bad_.view(); }

 private:
  [[nodiscard]] constexpr bool is_header(std::size_t offset) const {
    return window_[offset] == header && window_[offset + 1] == second_byte_;
  }
  [[nodiscard]] constexpr Result<Position> frame_at(std::size_t offset) const {
    if (!is_header(offset)) return Error::unexpected_reply;
    return decode_position(format_, Bytes(window_).subspan(offset, frame_));
  }

  // Processes the next frame while aligned. Returns false if more bytes are needed.
  template <class OnFrame>
  constexpr bool follow(OnFrame& on_frame) {
    if (size_ < frame_) return false;
    // A frame that lost bytes may contain the header of the next one: in FF 81 02 (00 82 lost) FF 81 the second FF 81
    // begins the next frame.
    const bool may_hold_header =
        std::find(window_.begin() + 2, window_.begin() + end(frame_), header) != window_.begin() + end(frame_);
    const bool good = frame_at(0).has_value();
    if (good && may_hold_header && size_ < frame_ + 2) return false;
    if (good && (!may_hold_header || is_header(frame_))) {
      emit_frame(on_frame);
    } else {
      lose(on_frame);
    }
    return true;
  }

  // Looks for two valid frames in a row. Returns false if more bytes are needed.
  template <class OnFrame>
  constexpr bool search(OnFrame& on_frame) {
    if (size_ < frame_) return false;
    const Result<Position> first = frame_at(0);
    if (first.error() == Error::out_of_range) saw_larger_positions_ = true;
    if (first && size_ < 2 * frame_) return false;
    if (first && frame_at(frame_) && !is_too_early()) {
      in_step_ = true;
      emit_frame(on_frame);
      emit_frame(on_frame);
    } else {
      discarded_.skip(1);
      remove(1);
    }
    return true;
  }

  // Returns whether the second of two frames came less than half a period after the first.
  [[nodiscard]] constexpr bool is_too_early() const {
    const Time between = times_[2 * frame_ - 1] - times_[frame_ - 1];
    return between > Time{} && between < format_.period() / 2;
  }

  template <class OnFrame>
  constexpr void emit_frame(OnFrame& on_frame) {
    const StreamFrame found{.singleturn = frame_at(0)->singleturn, .at = times_[frame_ - 1]};
    discarded_.found();
    remove(frame_);
    on_frame(found);
  }

  template <class OnFrame>
  constexpr void lose(OnFrame& on_frame) {
    in_step_ = false;
    bad_.clear();
    bad_.append(Bytes(window_).first(frame_));
    const Error error = decode_position(format_, bad_).error();
    on_frame(StreamFrame{.error = error == Error::none ? Error::unexpected_reply : error});
  }

  constexpr void remove(std::size_t count) {
    std::copy(window_.begin() + end(count), window_.begin() + end(size_), window_.begin());
    std::copy(times_.begin() + end(count), times_.begin() + end(size_), times_.begin());
    size_ -= count;
  }
  [[nodiscard]] static constexpr std::ptrdiff_t end(std::size_t count) { return static_cast<std::ptrdiff_t>(count); }

  Format format_;
  std::size_t frame_;  // number of bytes of a frame
  std::uint8_t second_byte_;
  bool in_step_ = false;
  bool saw_larger_positions_ = false;
  DiscardedFrames discarded_;
  std::array<std::uint8_t, 2 * frame_capacity> window_{};  // received bytes that may still become a frame
  std::array<Time, 2 * frame_capacity> times_{};
  std::size_t size_ = 0;
  FrameBytes bad_;
};

}  // namespace absenc::raa38::serial
