// SPDX-License-Identifier: Apache-2.0
// Finds the frames in what an encoder transmits by itself: whole frames where the last one says that they must be, and
// a search by header, checksum, range and period where something was lost.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/protocol/discarded.hpp"
#include "absenc/protocol/raa38/serial/frame.hpp"

namespace absenc::raa38::serial {

/// A frame, or why the one that was due is none: told once, until the frames are found again.
struct Found {
  Error error = Error::none;
  std::uint32_t singleturn = 0;
  Time at{};  // when its last byte was there
};

/// A frame is believed where the one before it ended; one that has an FF inside only when another header follows, which
/// may be a period later. Anywhere else two good ones must stand in a row, and both are handed out: a disturbance costs
/// the frames that it hits, and one good one where it leaves no two together.
class StreamDecoder {
 public:
  /// Of what nobody asks an encoder of this format for.
  explicit constexpr StreamDecoder(const Format& format)
      : format_(format),
        frame_(format.frame_bytes()),
        second_byte_(format.own_second_byte()),
        discarded_(format.frame_bytes()) {}

  /// `at`: when these bytes were there. Calls `on_frame(const Found&)` in the order of the line.
  template <class OnFrame>
  constexpr void feed(Bytes bytes, Time at, OnFrame&& on_frame) {
    for (const std::uint8_t byte : bytes) {
      window_[size_] = byte;
      times_[size_++] = at;
      while (in_step_ ? follow(on_frame) : search(on_frame)) {
      }
    }
  }

  /// A character came that cannot be used.
  template <class OnFrame>
  constexpr void disturbed(OnFrame&& on_frame) {
    discarded_.skip(size_ + 1);
    size_ = 0;
    if (!in_step_) return;
    in_step_ = false;
    bad_.clear();
    on_frame(Found{.error = Error::bad_framing});
  }

  /// Whether the next frame is known to begin where the last one ended.
  [[nodiscard]] constexpr bool in_step() const { return in_step_; }
  /// Bytes that belong to no frame.
  [[nodiscard]] constexpr std::uint64_t skipped() const { return discarded_.skipped(); }
  /// Frames that were damaged, or could not be told from damaged ones.
  [[nodiscard]] constexpr std::uint64_t discarded() const { return discarded_.count(); }
  /// Whether something looked like a frame but for a position with too many bits.
  [[nodiscard]] constexpr bool saw_larger_positions() const { return saw_larger_positions_; }
  /// The bytes of the last frame that was none.
  [[nodiscard]] constexpr Bytes bad() const { return bad_.view(); }

 private:
  [[nodiscard]] constexpr bool is_header(std::size_t offset) const {
    return window_[offset] == header && window_[offset + 1] == second_byte_;
  }
  [[nodiscard]] constexpr Result<Position> frame_at(std::size_t offset) const {
    if (!is_header(offset)) return Error::unexpected_reply;
    return decode_position(format_, Bytes(window_).subspan(offset, frame_));
  }

  // The next frame where it must be. False: more bytes are needed.
  template <class OnFrame>
  constexpr bool follow(OnFrame& on_frame) {
    if (size_ < frame_) return false;
    // Where bytes were lost, the header of the next frame slips into a frame: FF 81 02 (FF 80 lost) FF 81 is a good one
    // to every check but that no header follows it.
    const bool may_hold_header =
        std::find(window_.begin() + 2, window_.begin() + end(frame_), header) != window_.begin() + end(frame_);
    const bool good = frame_at(0).has_value();
    if (good && may_hold_header && size_ < frame_ + 2) return false;
    if (good && (!may_hold_header || is_header(frame_))) {
      hand_out(on_frame);
    } else {
      lose(on_frame);
    }
    return true;
  }

  // Two in a row. What cannot begin any is dropped.
  template <class OnFrame>
  constexpr bool search(OnFrame& on_frame) {
    if (size_ < frame_) return false;
    const Result<Position> first = frame_at(0);
    if (first.error() == Error::out_of_range) saw_larger_positions_ = true;
    if (first && size_ < 2 * frame_) return false;
    if (first && frame_at(frame_) && !is_too_early()) {
      in_step_ = true;
      hand_out(on_frame);
      hand_out(on_frame);
    } else {
      discarded_.skip(1);
      remove(1);
    }
    return true;
  }

  // Two frames nearer to each other than the refresh rate allows are made of something else.
  [[nodiscard]] constexpr bool is_too_early() const {
    const Time between = times_[2 * frame_ - 1] - times_[frame_ - 1];
    return between > Time{} && between < format_.period() / 2;
  }

  template <class OnFrame>
  constexpr void hand_out(OnFrame& on_frame) {
    const Found found{.singleturn = frame_at(0)->singleturn, .at = times_[frame_ - 1]};
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
    on_frame(Found{.error = error == Error::none ? Error::unexpected_reply : error});
  }

  constexpr void remove(std::size_t count) {
    std::copy(window_.begin() + end(count), window_.begin() + end(size_), window_.begin());
    std::copy(times_.begin() + end(count), times_.begin() + end(size_), times_.begin());
    size_ -= count;
  }
  [[nodiscard]] static constexpr std::ptrdiff_t end(std::size_t count) { return static_cast<std::ptrdiff_t>(count); }

  Format format_;
  std::size_t frame_;  // its bytes
  std::uint8_t second_byte_;
  bool in_step_ = false;
  bool saw_larger_positions_ = false;
  DiscardedFrames discarded_;
  std::array<std::uint8_t, 2 * frame_capacity> window_{};  // what may still become a frame
  std::array<Time, 2 * frame_capacity> times_{};
  std::size_t size_ = 0;
  FrameBytes bad_;
};

}  // namespace absenc::raa38::serial
