// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/hex_line.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>

namespace absenc::capture {

namespace {

bool all_hex(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return hex_digit(c) >= 0; });
}

template <class Number>
std::optional<Number> whole(std::string_view text, int base) {
  Number value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// A group of digits, after its prefix.
bool append_group(std::string_view group, std::vector<std::uint8_t>& bytes) {
  bool prefixed = true;
  if (group.starts_with("0x") || group.starts_with("0X") || group.starts_with("\\x")) {
    group.remove_prefix(2);
  } else if (group.starts_with('$')) {
    group.remove_prefix(1);
  } else {
    prefixed = false;
  }
  if (prefixed && group.size() == 1 && hex_digit(group[0]) >= 0) {
    bytes.push_back(static_cast<std::uint8_t>(hex_digit(group[0])));
    return true;
  }
  if (group.empty()) return false;
  while (!group.empty()) {
    if (group.size() < 2 || hex_digit(group[0]) < 0 || hex_digit(group[1]) < 0) return false;
    bytes.push_back(static_cast<std::uint8_t>(hex_digit(group[0]) << 4 | hex_digit(group[1])));
    group.remove_prefix(2);
    if (prefixed && group.starts_with("\\x")) group.remove_prefix(2);
  }
  return true;
}

bool append_groups(std::string_view text, std::vector<std::uint8_t>& bytes) {
  constexpr std::string_view separators = " \t,;";
  for (;;) {
    text.remove_prefix(std::min(text.find_first_not_of(separators), text.size()));
    if (text.empty()) return true;
    const std::string_view group = text.substr(0, text.find_first_of(separators));
    if (!append_group(group, bytes)) return false;
    text.remove_prefix(group.size());
  }
}

std::string_view unwrap(std::string_view word) {
  if (word.ends_with(':')) word.remove_suffix(1);
  const bool brackets = word.starts_with('[') && word.ends_with(']');
  const bool parentheses = word.starts_with('(') && word.ends_with(')');
  return brackets || parentheses ? word.substr(1, word.size() - 2) : word;
}

int direction(std::string_view word) {
  constexpr std::array<std::array<std::string_view, 7>, 2> words = {
      {{"tx", "out", "host", ">", ">>", "->", "-->"}, {"rx", "in", "device", "<", "<<", "<-", "<--"}}};
  std::string lower(unwrap(word).substr(0, 8));
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (std::find(words[i].begin(), words[i].end(), lower) != words[i].end()) return static_cast<int>(i);
  }
  return -1;
}

// "12.000250", "250us", "17:55:24.123", "2026-11-21T17:55:24Z".
std::optional<Instant> parse_time(std::string_view word) {
  word = unwrap(word);
  if (word.find(':') != std::string_view::npos) return parse_clock(word);
  struct Unit {
    std::string_view suffix;
    std::string_view power;
  };
  constexpr std::array<Unit, 4> units = {{{"ms", "e-3"}, {"us", "e-6"}, {"ns", "e-9"}, {"s", ""}}};
  for (const Unit& unit : units) {
    if (!word.ends_with(unit.suffix) || word.size() > 40) continue;
    std::string number(word.substr(0, word.size() - unit.suffix.size()));
    return parse_seconds(number + std::string(unit.power));
  }
  return word.find('.') == std::string_view::npos ? std::nullopt : parse_seconds(word);
}

// A clock may be of two words: "2026-11-21 17:55:24".
std::optional<Instant> take_time(std::string_view& text) {
  std::string_view rest = text;
  std::string_view word = take_word(rest);
  if (word.starts_with('[') && word.find(']') == std::string_view::npos) {
    const std::size_t close = rest.find(']');
    if (close == std::string_view::npos) return std::nullopt;
    word = std::string_view(word.data(), static_cast<std::size_t>(rest.data() + close + 1 - word.data()));
    rest.remove_prefix(close + 1);
    std::string_view inner = trim(word.substr(1, word.size() - 2));  // "[   12.345]"
    if (const auto at = parse_time(inner)) {
      text = rest;
      return at;
    }
  }
  std::optional<Instant> at = parse_time(word);
  if (!at && word.size() == 10 && word[4] == '-') {
    const std::string_view second = take_word(rest);
    at = parse_clock(std::string(word) + " " + std::string(unwrap(second)));
  }
  if (at) text = rest;
  return at;
}

bool parse_plain(std::string_view line, HexLine& parsed) {
  parsed.at = take_time(line);
  std::string_view rest = line;
  parsed.channel = direction(take_word(rest));
  if (parsed.channel >= 0) line = rest;
  return append_groups(line, parsed.bytes);
}

// "00000010  48 65 6c  |Hel|"
bool parse_dump(std::string_view line, HexLine& parsed) {
  if (line == "*") {
    parsed.trouble = "'*' stands for lines that the dump left out: write it with hexdump -v -C or od -v";
    return false;
  }
  line = line.substr(0, line.find('|'));
  const std::string_view offset = take_word(line);
  parsed.offset = whole<std::uint64_t>(offset, 16);
  if (!parsed.offset || offset.size() < 6) return false;
  for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
    if (word.size() != 2 || !append_group(word, parsed.bytes)) {
      parsed.trouble = "a dump needs single bytes: write it with hexdump -v -C or xxd";
      return false;
    }
  }
  return true;
}

// "00000010: 4865 6c6c 6f0a            Hello." The text stands behind two blanks.
bool parse_xxd(std::string_view line, HexLine& parsed) {
  if (line == "*") {
    parsed.trouble = "'*' stands for lines that the dump left out: write it without -a";
    return false;
  }
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) return false;
  parsed.offset = whole<std::uint64_t>(line.substr(0, colon), 16);
  line.remove_prefix(std::min(colon + 2, line.size()));
  return parsed.offset && append_groups(line.substr(0, line.find("  ")), parsed.bytes);
}

// "210-290 uart-1: rx-data: 1A"
bool parse_sigrok(std::string_view line, HexLine& parsed) {
  std::string_view rest = line;
  const std::string_view range = take_word(rest);
  if (const std::size_t dash = range.find('-'); dash != std::string_view::npos && !range.ends_with(':')) {
    parsed.begin = whole<Tick>(range.substr(0, dash), 10);
    const auto end = whole<Tick>(range.substr(dash + 1), 10);
    if (!parsed.begin || !end || *end < *parsed.begin) return false;
    parsed.end = *end;
    line = rest;
  }
  if (const std::string_view decoder = take_word(line); !decoder.starts_with("uart") || !decoder.ends_with(':'))
    return false;
  rest = line;
  const std::string_view kind = take_word(rest);
  const bool classed = kind.ends_with(':');
  if (classed) {
    if (kind != "rx-data:" && kind != "tx-data:") return true;  // an annotation of something else
    parsed.channel = kind == "tx-data:" ? 0 : 1;
    line = rest;
  }
  const std::string_view value = trim(line);
  if (value.size() == 2 && all_hex(value)) return append_group(value, parsed.bytes);
  return !classed && !value.empty();  // "Start bit", "1" ...
}

bool is_offset(std::string_view word, std::string_view line) {
  const bool zeros = word.find_first_not_of('0') == std::string_view::npos;
  return word.size() >= 6 && word.size() <= 16 && all_hex(word) && (line.find('|') != std::string_view::npos || zeros);
}

}  // namespace

std::string_view strip_comment(std::string_view line) {
  const std::size_t hash = line.find('#');
  const std::size_t slashes = line.find("//");
  return trim(line.substr(0, std::min(hash, slashes)));
}

std::optional<HexForm> hex_form(std::string_view line) {
  std::string_view rest = line;
  const std::string_view first = take_word(rest);
  HexForm form = HexForm::plain;
  if (line.find("uart") != std::string_view::npos) {
    form = HexForm::sigrok;
  } else if (is_offset(first, line) && !trim(rest).empty()) {
    form = HexForm::dump;
  } else if (first.size() >= 6 && first.size() <= 17 && first.ends_with(':') &&
             all_hex(first.substr(0, first.size() - 1))) {
    form = HexForm::xxd;
  }
  HexLine parsed;
  if (!parse_hex_line(form, line, parsed)) return std::nullopt;
  return form;
}

bool parse_hex_line(HexForm form, std::string_view line, HexLine& parsed) {
  parsed.at.reset();
  parsed.begin.reset();
  parsed.end = 0;
  parsed.channel = -1;
  parsed.offset.reset();
  parsed.bytes.clear();
  parsed.trouble = nullptr;
  switch (form) {
    case HexForm::plain:
      return parse_plain(line, parsed);
    case HexForm::dump:
      return parse_dump(line, parsed);
    case HexForm::xxd:
      return parse_xxd(line, parsed);
    case HexForm::sigrok:
      return parse_sigrok(line, parsed);
  }
  return false;
}

}  // namespace absenc::capture
