// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/text_lines.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

namespace absenc::capture {

namespace {

constexpr std::size_t read_at_once = 1 << 18;

// Parses all of `text` as a whole number of at most `most` digits; returns nothing if that fails.
template <class Number>
std::optional<Number> whole(std::string_view text, std::size_t most) {
  Number value = 0;
  if (text.empty() || text.size() > most || !std::all_of(text.begin(), text.end(), is_digit)) return std::nullopt;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// The digits of a decimal number, and the place of its point with the exponent applied.
struct Decimal {
  std::array<char, 64> digits{};
  std::size_t count = 0;
  std::int64_t point = 0;
};

std::optional<Decimal> parse_decimal(std::string_view text) {
  Decimal decimal;
  std::int64_t exponent = 0;
  if (const std::size_t e = text.find_first_of("eE"); e != std::string_view::npos) {
    std::string_view power = text.substr(e + 1);
    const bool negative = power.starts_with('-');
    if (negative || power.starts_with('+')) power.remove_prefix(1);
    const auto value = whole<std::int64_t>(power, 3);
    if (!value) return std::nullopt;
    exponent = negative ? -*value : *value;
    text = text.substr(0, e);
  }
  bool point = false;
  std::int64_t before = 0;
  for (const char c : text) {
    if (c == '.' && !point) {
      point = true;
    } else if (is_digit(c) && decimal.count < decimal.digits.size()) {
      decimal.digits[decimal.count++] = c;
      if (!point) ++before;
    } else if (!is_digit(c) || !point) {  // there may be any number of digits behind the decimal point
      return std::nullopt;
    }
  }
  if (decimal.count == 0) return std::nullopt;
  decimal.point = before + exponent;
  return decimal;
}

// Returns the whole number formed by `count` digits of `decimal` from index `first` on; digits that it lacks count as
// 0.
std::int64_t digits_at(const Decimal& decimal, std::int64_t first, std::int64_t count) {
  std::int64_t value = 0;
  for (std::int64_t i = first; i < first + count; ++i) {
    const bool inside = i >= 0 && std::cmp_less(i, decimal.count);
    value = 10 * value + (inside ? decimal.digits[static_cast<std::size_t>(i)] - '0' : 0);
  }
  return value;
}

// Parses seconds in the form "12.000125" fast, because files may have a million rows.
bool read_plain_seconds(std::string_view text, Instant& instant) {
  constexpr std::ptrdiff_t most_digits = 18;
  constexpr std::array<std::int64_t, 13> picoseconds = {
      1'000'000'000'000, 100'000'000'000, 10'000'000'000, 1'000'000'000, 100'000'000, 10'000'000, 1'000'000,
      100'000,           10'000,          1'000,          100,           10,          1};
  const auto end = text.end();
  auto at = text.begin();
  for (; at != end && is_digit(*at) && at - text.begin() < most_digits; ++at) {
    instant.seconds = 10 * instant.seconds + (*at - '0');
  }
  if (at == text.begin() || at == end || *at != '.') return false;
  const auto fraction = ++at;
  for (; at != end && is_digit(*at) && at - fraction < 12; ++at) {
    instant.picoseconds = 10 * instant.picoseconds + (*at - '0');
  }
  instant.picoseconds *= picoseconds[static_cast<std::size_t>(at - fraction)];
  return at == end;
}

// Parses seconds in any decimal form; returns false if `text` is no number or has too many digits.
bool read_seconds(std::string_view text, Instant& instant) {
  const std::optional<Decimal> decimal = parse_decimal(text);
  if (!decimal || decimal->point > 18) return false;
  instant = {digits_at(*decimal, 0, std::max<std::int64_t>(decimal->point, 0)),
             digits_at(*decimal, decimal->point, 12)};
  return true;
}

// Returns the days since 1970 for a date like "2026-11-21"; nothing for an invalid date.
std::optional<std::int64_t> parse_day(std::string_view text) {
  if (text.size() != 10 || text[4] != '-' || text[7] != '-') return std::nullopt;
  const auto year = whole<int>(text.substr(0, 4), 4);
  const auto month = whole<unsigned>(text.substr(5, 2), 2);
  const auto day = whole<unsigned>(text.substr(8, 2), 2);
  if (!year || !month || !day) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(*year), std::chrono::month(*month), std::chrono::day(*day)};
  if (!date.ok()) return std::nullopt;
  return std::chrono::sys_days(date).time_since_epoch().count();
}

// Returns the seconds east of Greenwich for a time zone like "+01:00", "-0330", "Z" or "".
std::optional<std::int64_t> parse_zone(std::string_view text) {
  if (text.empty() || text == "Z") return 0;
  const std::string_view minutes =
      text.size() == 6 && text[3] == ':' ? text.substr(4) : text.substr(std::min<std::size_t>(3, text.size()));
  const auto hour = whole<std::int64_t>(text.substr(1, 2), 2);
  const auto minute = whole<std::int64_t>(minutes, 2);
  if ((text[0] != '+' && text[0] != '-') || !hour || !minute) return std::nullopt;
  return (text[0] == '-' ? -1 : 1) * (*hour * 3600 + *minute * 60);
}

}  // namespace

bool TextLines::refill() {
  if (begin_ != 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    base_ += begin_;
    end_ -= begin_;
    begin_ = 0;
  }
  if (end_ == longest_line) return false;
  const std::uint64_t left = source_.size() - std::min(source_.size(), base_ + end_);
  if (left == 0) return false;
  const auto more = static_cast<std::size_t>(std::min<std::uint64_t>(left, read_at_once));
  buffer_.resize(std::min(longest_line, std::max(buffer_.size(), end_ + more)));
  const std::size_t got = source_.read(base_ + end_, std::span(buffer_).subspan(end_));
  end_ += got;
  return got != 0;
}

bool TextLines::next(std::string_view& line) {
  std::size_t searched = begin_;
  for (;;) {
    const auto* text = reinterpret_cast<const char*>(buffer_.data());
    const void* found = searched == end_ ? nullptr : std::memchr(text + searched, '\n', end_ - searched);
    if (found != nullptr) {
      offset_ = base_ + begin_;
      const auto at = static_cast<std::size_t>(static_cast<const char*>(found) - text);
      line = std::string_view(text + begin_, at - begin_);
      begin_ = at + 1;
      break;
    }
    const std::size_t remaining = end_ - begin_;
    if (refill()) {
      searched = begin_ + remaining;
      continue;
    }
    offset_ = base_ + begin_;
    too_long_ = end_ - begin_ == longest_line;
    if (begin_ == end_ || too_long_) return false;
    line = std::string_view(reinterpret_cast<const char*>(buffer_.data()) + begin_, end_ - begin_);
    begin_ = end_;
    break;
  }
  if (line.ends_with('\r')) line.remove_suffix(1);
  return true;
}

std::optional<Instant> parse_seconds(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  Instant instant;
  if (!read_plain_seconds(text, instant) && !read_seconds(text, instant)) return std::nullopt;
  if (negative) {
    instant.seconds = -instant.seconds;
    if (instant.picoseconds != 0) {
      --instant.seconds;
      instant.picoseconds = picoseconds_per_second - instant.picoseconds;
    }
  }
  return instant;
}

std::optional<Instant> parse_clock(std::string_view text) {
  std::int64_t seconds = 0;
  if (text.size() > 11 && (text[10] == 'T' || text[10] == ' ')) {
    const auto day = parse_day(text.substr(0, 10));
    if (!day) return std::nullopt;
    seconds = *day * 86400;
    text.remove_prefix(11);
    const std::size_t zone = text.find_first_of("Z+-");
    if (zone != std::string_view::npos) {
      const auto east = parse_zone(text.substr(zone));
      if (!east) return std::nullopt;
      seconds -= *east;
      text = text.substr(0, zone);
    }
  }
  if (text.size() < 8 || text[2] != ':' || text[5] != ':') return std::nullopt;
  const auto hour = whole<std::int64_t>(text.substr(0, 2), 2);
  const auto minute = whole<std::int64_t>(text.substr(3, 2), 2);
  const auto second = parse_seconds(text.substr(6));
  if (!hour || !minute || !second || !is_digit(text[6]) || *minute > 59 || second->seconds > 60) return std::nullopt;
  return Instant{seconds + *hour * 3600 + *minute * 60 + second->seconds, second->picoseconds};
}

std::optional<std::uint64_t> parse_rate(std::string_view text) {
  text = trim(text);
  const std::size_t end = std::min(text.find_first_not_of("0123456789.,"), text.size());
  const std::string_view unit = trim(text.substr(end));
  const std::int64_t power = unit.empty() || unit == "Hz" ? 0
                             : unit == "kHz"              ? 3
                             : unit == "MHz"              ? 6
                             : unit == "GHz"              ? 9
                                                          : -1;
  std::optional<Decimal> decimal = parse_decimal(text.substr(0, end));
  if (!decimal || power < 0 || decimal->point + power > 18) return std::nullopt;
  const std::int64_t point = decimal->point + power;
  for (auto i = static_cast<std::size_t>(std::max<std::int64_t>(point, 0)); i < decimal->count; ++i) {
    if (decimal->digits[i] != '0') return std::nullopt;
  }
  const std::int64_t rate = digits_at(*decimal, 0, point);
  return rate > 0 ? std::optional(static_cast<std::uint64_t>(rate)) : std::nullopt;
}

std::string_view trim(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view take_word(std::string_view& text) {
  const std::size_t first = std::min(text.find_first_not_of(" \t"), text.size());
  text.remove_prefix(first);
  const std::string_view word = text.substr(0, std::min(text.find_first_of(" \t"), text.size()));
  text.remove_prefix(word.size());
  return word;
}

}  // namespace absenc::capture
