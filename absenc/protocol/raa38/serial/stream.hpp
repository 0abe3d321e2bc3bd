// SPDX-License-Identifier: Apache-2.0
// Finds the frames in what an encoder transmits by itself: whole frames where the last one says that they must be, and
// a search by header, checksum, range and period where something was lost.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "absenc/protocol/raa38/serial/frame.hpp"

namespace absenc::raa38::serial {

/// A frame, or why the one that was due is none: told once, until the frames are found again.
struct Found {
  Error error = Error::none;
  std::uint32_t singleturn = 0;
  Time at{};  // when its last byte was there
};

/// A frame is believed where the one before it ended; one that has an FF inside only when another header follows, which
/// may be a period later. Anywhere else two good ones must stand in a row, and both are
/// handed out: a disturbance costs the frames that it hits, and one good one where it leaves no two together.
class StreamDecoder {
 public:
  /// `second_byte` of every frame; `period` between their beginnings, 0: not known.
  explicit constexpr StreamDecoder(const Format& format, std::uint8_t second_byte = fixed_second_byte, Time period = {})
      : format_(format),
        mask_(static_cast<std::uint32_t>(low_mask(format.bits))),
        second_byte_(second_byte),
        period_(period) {}

  /// `at`: when these bytes were there. Calls `on_frame(const Found&)` in the order of the line.
  template <class OnFrame>
  constexpr void feed(Bytes bytes, Time at, OnFrame&& on_frame) {
    switch (format_.data_bytes()) {
      case 2:
        return feed_frames<5>(bytes, at, on_frame);
      case 3:
        return feed_frames<6>(bytes, at, on_frame);
      default:
        return feed_frames<7>(bytes, at, on_frame);
    }
  }

  /// A character came that cannot be used.
  template <class OnFrame>
  constexpr void disturbed(OnFrame&& on_frame) {
    skipped_ += held_ + (end_ - begin_) + 1;
    held_ = begin_ = end_ = 0;
    if (!in_step_) return;
    in_step_ = false;
    bad_.clear();
    on_frame(Found{.error = Error::bad_framing});
  }

  /// Whether the next frame is known to begin where the last one ended.
  [[nodiscard]] constexpr bool in_step() const { return in_step_; }
  /// Bytes that belong to no frame.
  [[nodiscard]] constexpr std::uint64_t skipped() const { return skipped_; }
  /// Whether something looked like a frame but for a position with too many bits.
  [[nodiscard]] constexpr bool saw_larger_positions() const { return saw_larger_positions_; }
  /// The bytes of the last frame that was none.
  [[nodiscard]] constexpr Bytes bad() const { return bad_.view(); }

 private:
  static constexpr std::size_t window_capacity = 4 * frame_capacity;

  template <std::size_t size, class OnFrame>
  constexpr void feed_frames(Bytes bytes, Time at, OnFrame& on_frame) {
    while (!bytes.empty()) {
      if (in_step_) {
        bytes = follow<size>(bytes, at, on_frame);
        continue;
      }
      take(bytes.front(), at);
      bytes = bytes.subspan(1);
      if (find<size>()) begin_following<size>(on_frame);
    }
  }

  // Everything but the length, without branches: a clean stream is one comparison a frame.
  template <std::size_t size>
  [[nodiscard]] constexpr bool fits(const std::uint8_t* frame, std::uint32_t& value) const {
    unsigned sum = 0u + header + second_byte_;
    std::uint32_t bits = 0;
    for (std::size_t i = 2; i + 1 < size; ++i) {
      bits = bits << 8 | frame[i];
      sum += frame[i];
    }
    value = bits;
    return static_cast<unsigned>(frame[0] == header) & static_cast<unsigned>(frame[1] == second_byte_) &
           static_cast<unsigned>((sum & 0xFF) == frame[size - 1]) & static_cast<unsigned>(bits <= mask_);
  }

  // Where bytes were lost, the header of the next frame slips into a frame: FF 81 02 (FF 80 lost) FF 81 is a good one
  // to every check but that no header follows it.
  template <std::size_t size>
  [[nodiscard]] static constexpr bool may_hold_header(const std::uint8_t* frame) {
    bool any = false;
    for (std::size_t i = 2; i < size; ++i) any |= frame[i] == header;
    return any;
  }
  [[nodiscard]] constexpr bool is_header(const std::uint8_t* bytes) const {
    return bytes[0] == header && bytes[1] == second_byte_;
  }

  // A frame in the low bytes of a word: 0 when it is good, and has no FF inside or the next header behind it. Without
  // branches. Of seven bytes the word does not hold all of the next header.
  template <std::size_t size>
  [[nodiscard]] static constexpr std::uint64_t wrong_in_word(std::uint64_t word, std::uint8_t second_byte,
                                                             std::uint32_t mask, std::uint32_t& value) {
    constexpr bool sees_next = size + 2 <= sizeof(std::uint64_t);
    constexpr std::uint64_t next_header = sees_next ? std::uint64_t{1} << 8 * size : 0;
    constexpr std::uint64_t ones = 0x0101'0101'0101'0101 & low_mask(8 * (size - 2));
    const std::uint64_t headers = (header | static_cast<std::uint64_t>(second_byte) << 8) * (1 + next_header);
    const std::uint64_t inside = word >> 16 & low_mask(8 * (size - 2));
    const std::uint64_t data = inside & low_mask(8 * (size - 3));
    std::uint64_t sum = 0u + header + second_byte;  // its low byte counts
    for (std::size_t i = 0; i + 3 < size; ++i) sum += data >> 8 * i;
    value = static_cast<std::uint32_t>(size == 5 ? (data & 0xFF) << 8 | data >> 8 : swapped(data) >> (88 - 8 * size));
    const std::uint64_t is_ff = sees_next ? 0 : (~inside - ones) & inside & (ones << 7);
    return ((word ^ headers) & 0xFFFF * (1 + next_header)) | ((sum ^ inside >> 8 * (size - 3)) & 0xFF) |
           (value & ~mask) | is_ff;
  }

  // Good frames, a word each, as far as nothing has to be waited for: how many bytes they take.
  template <std::size_t size, class OnFrame>
  [[nodiscard]] constexpr std::size_t plain_frames(Bytes bytes, Found& found, OnFrame& on_frame) const {
    if (std::is_constant_evaluated() || std::endian::native != std::endian::little) return 0;
    if (bytes.size() < sizeof(std::uint64_t)) return 0;
    const std::size_t last = bytes.size() - sizeof(std::uint64_t);
    const std::uint8_t second_byte = second_byte_;  // in registers, whatever on_frame writes
    const std::uint32_t mask = mask_;
    std::size_t at = 0;
    for (; at <= last; at += size) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes.data() + at, sizeof word);
      std::uint32_t value = 0;
      if (wrong_in_word<size>(word, second_byte, mask, value) != 0) break;
      found.singleturn = value;
      on_frame(found);
    }
    return at;
  }

  [[nodiscard]] static constexpr std::uint64_t swapped(std::uint64_t word) {
    word = (word & 0x00FF00FF00FF00FF) << 8 | (word >> 8 & 0x00FF00FF00FF00FF);
    word = (word & 0x0000FFFF0000FFFF) << 16 | (word >> 16 & 0x0000FFFF0000FFFF);
    return word << 32 | word >> 32;
  }

  // What remains behind the frames that stand in a row; all is used up while they do.
  template <std::size_t size, class OnFrame>
  constexpr Bytes follow(Bytes bytes, Time at, OnFrame& on_frame) {
    if (held_ != 0 && !complete_held<size>(bytes, at, on_frame)) return bytes;
    Found found{.at = at};
    while (bytes.size() >= size) {
      bytes = bytes.subspan(plain_frames<size>(bytes, found, on_frame));
      if (bytes.size() < size) break;
      const bool good = fits<size>(bytes.data(), found.singleturn);
      if (good && may_hold_header<size>(bytes.data())) {
        if (bytes.size() < size + 2) break;
        if (!is_header(bytes.data() + size)) return lose(bytes.first(size), at, bytes.subspan(size), on_frame);
      }
      if (!good) return lose(bytes.first(size), at, bytes.subspan(size), on_frame);
      on_frame(found);
      bytes = bytes.subspan(size);
    }
    std::copy(bytes.begin(), bytes.end(), partial_.begin());
    held_ = bytes.size();
    if (held_ >= size) held_at_ = at;
    return {};
  }

  // The frame of which a part was held back; false when there is nothing to follow any more, or not yet.
  template <std::size_t size, class OnFrame>
  constexpr bool complete_held(Bytes& bytes, Time at, OnFrame& on_frame) {
    while (held_ != 0) {
      Found found;
      const std::size_t wanted = held_ < size ? size : size + 2;
      if (wanted == size) held_at_ = at;
      const std::size_t more = std::min(wanted - held_, bytes.size());
      std::copy_n(bytes.begin(), more, partial_.begin() + static_cast<std::ptrdiff_t>(held_));
      held_ += more;
      bytes = bytes.subspan(more);
      if (held_ < wanted) return false;
      const bool good = fits<size>(partial_.data(), found.singleturn);
      if (wanted == size && good && may_hold_header<size>(partial_.data())) continue;
      if (!good || (wanted != size && !is_header(partial_.data() + size))) {
        bytes = lose({partial_.data(), wanted}, at, bytes, on_frame);
        return false;
      }
      found.at = held_at_;
      on_frame(found);
      std::copy_n(partial_.begin() + static_cast<std::ptrdiff_t>(size), wanted - size, partial_.begin());
      held_ = wanted - size;
    }
    return true;
  }

  template <class OnFrame>
  constexpr Bytes lose(Bytes frame, Time at, Bytes rest, OnFrame& on_frame) {
    in_step_ = false;
    held_ = begin_ = end_ = 0;
    for (const std::uint8_t byte : frame) take(byte, at);
    bad_.clear();
    bad_.append(frame.first(format_.frame_bytes()));
    const Error error = decode_position(format_, bad_).error();
    on_frame(Found{.error = error == Error::none ? Error::unexpected_reply : error});
    return rest;
  }

  constexpr void take(std::uint8_t byte, Time at) {
    if (end_ == window_capacity) {
      std::copy(window_.begin() + static_cast<std::ptrdiff_t>(begin_), window_.end(), window_.begin());
      std::copy(times_.begin() + static_cast<std::ptrdiff_t>(begin_), times_.end(), times_.begin());
      end_ -= begin_;
      begin_ = 0;
    }
    window_[end_] = byte;
    times_[end_++] = at;
  }

  constexpr void drop(std::size_t count) {
    begin_ += count;
    skipped_ += count;
  }

  template <std::size_t size>
  [[nodiscard]] constexpr bool fits_at(std::size_t offset) {
    std::uint32_t value = 0;
    return fits<size>(window_.data() + begin_ + offset, value);
  }

  // Whether frames to follow begin at `begin_`: two in a row. What cannot begin any is dropped.
  template <std::size_t size>
  [[nodiscard]] constexpr bool find() {
    for (;;) {
      if (end_ - begin_ < size) return false;
      if (!fits_at<size>(0)) {
        note_larger<size>();
        drop(1);
        continue;
      }
      if (end_ - begin_ < 2 * size) return false;
      if (!fits_at<size>(size) || is_too_early<size>()) {
        drop(1);
        continue;
      }
      if (!has_pause_inside<size>(0)) return true;
      if (end_ - begin_ < 3 * size - 1) return false;
      drop(better_place<size>());
      return true;
    }
  }

  // Two frames nearer to each other than the refresh rate allows are made of something else.
  template <std::size_t size>
  [[nodiscard]] constexpr bool is_too_early() const {
    const Time between = times_[begin_ + 2 * size - 1] - times_[begin_ + size - 1];
    return between > Time{} && between < period_ / 2;
  }

  // The encoder rests between frames, not inside one: a longer rest inside means that they begin elsewhere. (Or that
  // the operating system came late: so this only decides where frames could begin at more than one place.)
  template <std::size_t size>
  [[nodiscard]] constexpr bool has_pause_inside(std::size_t offset) const {
    if (period_ == Time{}) return false;
    const auto before = [&](std::size_t i) { return times_[begin_ + offset + i] - times_[begin_ + offset + i - 1]; };
    for (std::size_t i = 1; i < 2 * size; ++i) {
      if (i != size && before(i) > before(size)) return true;
    }
    return false;
  }

  template <std::size_t size>
  [[nodiscard]] constexpr std::size_t better_place() {
    for (std::size_t offset = 1; offset < size; ++offset) {
      if (fits_at<size>(offset) && fits_at<size>(offset + size) && !has_pause_inside<size>(offset)) return offset;
    }
    return 0;
  }

  template <std::size_t size>
  constexpr void note_larger() {
    const Bytes frame(window_.data() + begin_, size);
    if (frame[1] == second_byte_ && decode_position(format_, frame).error() == Error::out_of_range) {
      saw_larger_positions_ = true;
    }
  }

  template <std::size_t size, class OnFrame>
  constexpr void begin_following(OnFrame& on_frame) {
    in_step_ = true;
    for (int i = 0; i < 2; ++i) {
      Found found{.at = times_[begin_ + size - 1]};
      static_cast<void>(fits<size>(window_.data() + begin_, found.singleturn));
      begin_ += size;
      on_frame(found);
    }
    held_ = end_ - begin_;  // less than a frame
    std::copy_n(window_.begin() + static_cast<std::ptrdiff_t>(begin_), held_, partial_.begin());
    begin_ = end_ = 0;
  }

  Format format_;
  std::uint32_t mask_;
  std::uint8_t second_byte_;
  Time period_;
  bool in_step_ = false;
  bool saw_larger_positions_ = false;
  std::uint64_t skipped_ = 0;
  std::array<std::uint8_t, frame_capacity + 2> partial_{};  // in step: the next frame, and what must follow it,
  std::size_t held_ = 0;                                    // so much of it
  std::array<std::uint8_t, window_capacity> window_{};      // not in step: what may still become a frame
  std::array<Time, window_capacity> times_{};
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  Time held_at_{};
  FrameBytes bad_;
};

}  // namespace absenc::raa38::serial
