// SPDX-License-Identifier: Apache-2.0
// Reads a text file line by line, and parses times as people and programs write them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "absenc/capture/files/source.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Length of a line, in bytes, from which on `TextLines` refuses to read it.
inline constexpr std::size_t longest_line = 1 << 20;

[[nodiscard]] constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

class TextLines {
 public:
  explicit TextLines(Source& source) : source_(source) {}

  /// Reads the next line, without its line end, into `line`, which is valid until the next call. Returns false if there
  /// is none or it is too long.
  [[nodiscard]] bool next(std::string_view& line);

  /// Returns the offset in the file of the line that `next` returned last.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }
  [[nodiscard]] bool too_long() const { return too_long_; }

 private:
  bool refill();

  Source& source_;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;  // index of the first unread byte in the buffer
  std::size_t end_ = 0;
  std::uint64_t base_ = 0;  // offset in the file of the buffer's first byte
  std::uint64_t offset_ = 0;
  bool too_long_ = false;
};

inline constexpr std::int64_t nanosecond = 1000;  // number of picoseconds in a nanosecond
inline constexpr std::int64_t picoseconds_per_second = 1'000'000'000'000;

/// A time of day, with or without a date, or a time on any counter.
struct Instant {
  std::int64_t seconds = 0;
  std::int64_t picoseconds = 0;  // part of a second, in picoseconds from 0 to 10^12 - 1, which is added to `seconds`
};

/// Parses seconds like "12", "-0.000125", "1.8e-08"; digits below a picosecond are cut off.
[[nodiscard]] std::optional<Instant> parse_seconds(std::string_view text);

/// Parses a clock time like "2026-11-21T17:55:24.123456789+00:00" or "17:55:24.123".
[[nodiscard]] std::optional<Instant> parse_clock(std::string_view text);

/// Returns the ticks of `picoseconds` between two instants; nothing if negative or too large.
[[nodiscard]] constexpr std::optional<Tick> ticks_between(const Instant& from, const Instant& to,
                                                          std::int64_t picoseconds) {
  // The seconds of both instants are below 10^18, so their difference does not overflow.
  std::int64_t seconds = to.seconds - from.seconds;
  std::int64_t rest = to.picoseconds - from.picoseconds;
  if (rest < 0) {
    rest += picoseconds_per_second;
    --seconds;
  }
  const std::int64_t per_second = picoseconds_per_second / picoseconds;
  if (seconds < 0 || seconds > std::numeric_limits<std::int64_t>::max() / per_second - 1) return std::nullopt;
  return static_cast<Tick>(seconds * per_second + rest / picoseconds);
}

/// Parses a rate like "1 MHz", "12.5 kHz" or "250000"; returns whole hertz above 0, or nothing.
[[nodiscard]] std::optional<std::uint64_t> parse_rate(std::string_view text);

[[nodiscard]] std::string_view trim(std::string_view text);

/// Removes the next word, which ends at a blank, from `text` and returns it.
[[nodiscard]] std::string_view take_word(std::string_view& text);

/// Returns the value of a hexadecimal digit, 0 to 15, or -1 for another character.
[[nodiscard]] constexpr int hex_digit(char c) {
  return c >= '0' && c <= '9'   ? c - '0'
         : c >= 'a' && c <= 'f' ? c - 'a' + 10
         : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                : -1;
}

}  // namespace absenc::capture
