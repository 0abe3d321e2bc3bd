// SPDX-License-Identifier: Apache-2.0
// The ASCII protocol of serial-line CAN adapters (Lawicel CAN232): each frame is a line of text.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/bytes.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/core/result.hpp"
#include "absenc/link/can.hpp"

namespace absenc::slcan {

inline constexpr std::uint8_t end_of_line = '\r';  ///< end of a line; alone it is the adapter's reply "accepted"
inline constexpr std::uint8_t bell = 0x07;         ///< the adapter's reply "refused"

/// Longest line: T, 8 digits, length, 16 digits, 4 digits of time, CR.
inline constexpr std::size_t line_capacity = 31;
/// Text of one line, with or without its CR.
using LineText = ByteBuffer<line_capacity>;

/// Returns whether `byte` begins a frame: t or T (data), r or R (remote).
[[nodiscard]] constexpr bool begins_frame(std::uint8_t byte) {
  return byte == 't' || byte == 'T' || byte == 'r' || byte == 'R';
}

/// Returns the digit that sets the bit rate `rate` in the command S; nothing if there is none.
[[nodiscard]] constexpr std::optional<std::uint8_t> rate_code(std::uint32_t rate) {
  constexpr std::array<std::uint32_t, 9> rates{10'000,  20'000,  50'000,  100'000,  125'000,
                                               250'000, 500'000, 800'000, 1'000'000};
  for (std::size_t i = 0; i < rates.size(); ++i) {
    if (rates[i] == rate) return static_cast<std::uint8_t>('0' + i);
  }
  return std::nullopt;
}

/// Returns the bit rate of the digit `code`, the inverse of `rate_code`; 0 if `code` is invalid.
[[nodiscard]] constexpr std::uint32_t rate_of(std::uint8_t code) {
  for (const std::uint32_t rate :
       {10'000u, 20'000u, 50'000u, 100'000u, 125'000u, 250'000u, 500'000u, 800'000u, 1'000'000u}) {
    if (rate_code(rate) == code) return rate;
  }
  return 0;
}

namespace detail {
constexpr void append_digits(LineText& text, std::uint32_t value, unsigned digits) {
  for (unsigned i = digits; i-- > 0;)
    text.push_back(static_cast<std::uint8_t>("0123456789ABCDEF"[value >> 4 * i & 15]));
}

// Returns the number written in hexadecimal digits, or -1 when a character is no digit.
constexpr std::int64_t digits_of(Bytes text) {
  std::int64_t value = 0;
  for (const std::uint8_t byte : text) {
    const int digit = hex_digit(static_cast<char>(byte));
    if (digit < 0) return -1;
    value = value << 4 | digit;
  }
  return value;
}
}  // namespace detail

/// Returns `frame` as a line with CR. `time`: timestamp in milliseconds, 0 to 59999; empty: none.
[[nodiscard]] constexpr LineText encode(const CanFrame& frame, std::optional<std::uint16_t> time = {}) {
  LineText text;
  text.push_back(frame.remote ? (frame.extended ? 'R' : 'r') : (frame.extended ? 'T' : 't'));
  detail::append_digits(text, frame.id, frame.extended ? 8 : 3);
  detail::append_digits(text, frame.size, 1);
  if (!frame.remote) {
    for (const std::uint8_t byte : frame.bytes()) detail::append_digits(text, byte, 2);
  }
  if (time) detail::append_digits(text, *time, 4);
  text.push_back(end_of_line);
  return text;
}

/// Returns the frame of a line without its CR; skips a timestamp. Errors: bad_framing, out_of_range, wrong_length.
[[nodiscard]] constexpr Result<CanFrame> decode(Bytes line) {
  if (line.empty() || !begins_frame(line[0])) return Error::bad_framing;
  CanFrame frame;
  frame.extended = line[0] == 'T' || line[0] == 'R';
  frame.remote = line[0] == 'r' || line[0] == 'R';
  const std::size_t id_digits = frame.extended ? 8 : 3;
  if (line.size() < 2 + id_digits) return Error::wrong_length;
  const std::int64_t id = detail::digits_of(line.subspan(1, id_digits));
  const std::int64_t size = detail::digits_of(line.subspan(1 + id_digits, 1));
  if (id < 0 || size < 0) return Error::bad_framing;
  if (id > (frame.extended ? 0x1FFFFFFF : 0x7FF) || size > 8) return Error::out_of_range;
  frame.id = static_cast<std::uint32_t>(id);
  frame.size = static_cast<std::uint8_t>(size);
  const Bytes rest = line.subspan(2 + id_digits);
  const std::size_t digits = frame.remote ? 0 : std::size_t{2} * frame.size;
  if (rest.size() != digits && rest.size() != digits + 4) return Error::wrong_length;
  if (detail::digits_of(rest.subspan(digits)) < 0) return Error::bad_framing;
  for (std::size_t i = 0; 2 * i < digits; ++i) {
    const std::int64_t byte = detail::digits_of(rest.subspan(2 * i, 2));
    if (byte < 0) return Error::bad_framing;
    frame.data[i] = static_cast<std::uint8_t>(byte);
  }
  return frame;
}

/// A reader that splits received bytes into lines, and resumes after garbage.
class LineReader {
 public:
  /// Event that a byte received from the adapter completes.
  enum class LineEvent : std::uint8_t {
    nothing,
    line,     ///< `line()` is complete and valid until the next byte; may be empty
    refused,  ///< the adapter refused a command (BEL)
    garbage,  ///< bytes that are no complete line were discarded
  };

  /// Adds a received byte and returns the event that it completes.
  constexpr LineEvent feed(std::uint8_t byte) {
    if (complete_) line_.clear();
    complete_ = false;
    if (byte == '\n') return LineEvent::nothing;
    if (byte == bell) return end(LineEvent::refused);
    if (byte == end_of_line) return lost_ ? end(LineEvent::garbage) : end(LineEvent::line);
    if (begins_frame(byte) && (lost_ || !line_.empty())) {
      line_.clear();
      lost_ = false;
      line_.push_back(byte);
      return LineEvent::garbage;
    }
    if (!lost_ && !line_.push_back(byte)) lost_ = true;
    return LineEvent::nothing;
  }

  /// Returns the complete line without its CR; valid directly after `feed` has returned `line`.
  [[nodiscard]] constexpr Bytes line() const { return line_; }

 private:
  constexpr LineEvent end(LineEvent found) {
    complete_ = true;
    lost_ = false;
    return found;
  }

  LineText line_;
  bool complete_ = false;
  bool lost_ = false;  // the current line is too long: bytes are discarded until a new line begins
};

}  // namespace absenc::slcan
