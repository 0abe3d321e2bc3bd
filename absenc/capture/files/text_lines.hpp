// SPDX-License-Identifier: Apache-2.0
// A text file line by line, and times as people and programs write them.
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

/// The longest line that is read as one.
inline constexpr std::size_t longest_line = 1 << 20;

[[nodiscard]] constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

class TextLines {
 public:
  explicit TextLines(Source& source) : source_(source) {}

  /// The next line without its end ("\n" or "\r\n"), until the next call. False at the end of the file, or where a line
  /// is longer than `longest_line`.
  [[nodiscard]] bool next(std::string_view& line);

  /// Bytes from the beginning of the file to the line that `next` gave last.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }
  [[nodiscard]] bool too_long() const { return too_long_; }

 private:
  bool refill();

  Source& source_;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;  // of what was not handed out
  std::size_t end_ = 0;
  std::uint64_t base_ = 0;  // of the buffer in the file
  std::uint64_t offset_ = 0;
  bool too_long_ = false;
};

inline constexpr std::int64_t nanosecond = 1000;  // picoseconds
inline constexpr std::int64_t picoseconds_per_second = 1'000'000'000'000;

/// A place in time: of a clock, or from whatever a program counts.
struct Instant {
  std::int64_t seconds = 0;
  std::int64_t picoseconds = 0;  // 0 to 10^12 - 1, later than `seconds`
};

/// "12", "-0.000125", "1.8e-08": seconds; what is below a picosecond is cut off. Nothing around it is allowed.
[[nodiscard]] std::optional<Instant> parse_seconds(std::string_view text);

/// "2026-11-21T17:55:24.123456789+00:00" (also a blank for T, Z, no zone), or "17:55:24.123", of whatever day.
[[nodiscard]] std::optional<Instant> parse_clock(std::string_view text);

/// Ticks of 10^12 / `picoseconds` a second; nothing when `to` is before `from` or too late to be counted.
[[nodiscard]] constexpr std::optional<Tick> ticks_between(const Instant& from, const Instant& to,
                                                          std::int64_t picoseconds) {
  // Both are below 10^18 seconds, so that the difference fits.
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

/// "1 MHz", "12.5 kHz", "250000": hertz; nothing when it is not a positive whole number.
[[nodiscard]] std::optional<std::uint64_t> parse_rate(std::string_view text);

[[nodiscard]] std::string_view trim(std::string_view text);

/// Takes the next word, ended by blanks, off `text`; "": no more.
[[nodiscard]] std::string_view take_word(std::string_view& text);

/// 0 to 15, or -1.
[[nodiscard]] constexpr int hex_digit(char c) {
  return c >= '0' && c <= '9'   ? c - '0'
         : c >= 'a' && c <= 'f' ? c - 'a' + 10
         : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                : -1;
}

}  // namespace absenc::capture
