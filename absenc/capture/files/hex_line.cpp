// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/hex_line.hpp"

#include <algorithm>
#include <charconv>
#include <string>

#include "absenc/capture/files/log_line.hpp"

namespace absenc::capture {

namespace {

bool all_hex(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return hex_digit(c) >= 0; });
}

template <class Number>
std::optional<Number> number_in(std::string_view text, int base) {
  Number value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool append_digits(std::string_view group, std::vector<std::uint8_t>& bytes) {
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

// Parses a line of hexdump -C or od, like "00000010  48 65 6c  |Hel|".
bool parse_dump(std::string_view line, HexLine& parsed) {
  if (line == "*") {
    parsed.problem = "'*' stands for lines that the dump left out: write it with hexdump -v -C or od -v";
    return false;
  }
  line = line.substr(0, line.find('|'));
  const std::string_view offset = take_word(line);
  parsed.offset = number_in<std::uint64_t>(offset, 16);
  if (!parsed.offset || offset.size() < 6) return false;
  for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
    if (word.size() != 2 || !append_group(word, parsed.bytes)) {
      parsed.problem = "a dump needs single bytes: write it with hexdump -v -C or xxd";
      return false;
    }
  }
  return true;
}

// Parses a line of xxd, like "00000010: 4865 6c6c 6f0a            Hello."
bool parse_xxd(std::string_view line, HexLine& parsed) {
  if (line == "*") {
    parsed.problem = "'*' stands for lines that the dump left out: write it without -a";
    return false;
  }
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) return false;
  parsed.offset = number_in<std::uint64_t>(line.substr(0, colon), 16);
  line.remove_prefix(std::min(colon + 2, line.size()));
  return parsed.offset && append_groups(line.substr(0, line.find("  ")), parsed.bytes);
}

// Parses a line of sigrok-cli, like "210-290 uart-1: rx-data: 1A".
bool parse_sigrok(std::string_view line, HexLine& parsed) {
  std::string_view rest = line;
  const std::string_view range = take_word(rest);
  if (const std::size_t dash = range.find('-'); dash != std::string_view::npos && !range.ends_with(':')) {
    parsed.begin = number_in<Tick>(range.substr(0, dash), 10);
    const auto end = number_in<Tick>(range.substr(dash + 1), 10);
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
    // annotations of sigrok classes other than data (start bit, stop bit ...) contain no bytes
    if (kind != "rx-data:" && kind != "tx-data:") return true;
    parsed.channel = kind == "tx-data:" ? 0 : 1;
    line = rest;
  }
  const std::string_view value = trim(line);
  if (value.size() == 2 && all_hex(value)) return append_group(value, parsed.bytes);
  return !classed && !value.empty();  // annotations like "Start bit" and "1" have no bytes
}

bool is_offset(std::string_view word, std::string_view line) {
  const bool zeros = word.find_first_not_of('0') == std::string_view::npos;
  return word.size() >= 6 && word.size() <= 16 && all_hex(word) && (line.find('|') != std::string_view::npos || zeros);
}

}  // namespace

bool append_group(std::string_view group, std::vector<std::uint8_t>& bytes) {
  const std::size_t before = bytes.size();
  if (append_digits(group, bytes)) return true;
  bytes.resize(before);
  return false;
}

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
  parsed.source.clear();
  parsed.problem.clear();
  switch (form) {
    case HexForm::plain:
      return parse_log_line(line, parsed);
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
