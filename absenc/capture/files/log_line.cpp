// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/log_line.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "absenc/core/bytes.hpp"

namespace absenc::capture {

namespace {

constexpr std::string_view blanks = " \t";
constexpr std::string_view separators = " \t,;|";

bool all_digits(std::string_view text) { return !text.empty() && std::all_of(text.begin(), text.end(), is_digit); }

std::string lower_case(std::string_view text) {
  std::string lower(text.substr(0, 64));
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

std::string quoted(std::string_view text) {
  std::string shown = "\"";
  for (const char c : text.substr(0, 40)) shown += c >= ' ' && c != 0x7F ? c : '?';
  return shown + "\"";
}

// ---- Bytes

// Appends the bytes of a group like "1A:00:35" or "1A-00-35"; returns false for another form.
bool append_joined(std::string_view group, std::vector<std::uint8_t>& bytes) {
  const std::size_t before = bytes.size();
  if (group.size() < 5 || (group[2] != ':' && group[2] != '-')) return false;
  for (std::size_t i = 0; i < group.size(); i += 3) {
    const bool joined = i + 2 == group.size() || (i + 3 < group.size() && group[i + 2] == group[2]);
    if (joined && append_group(group.substr(i, 2), bytes)) continue;
    bytes.resize(before);
    return false;
  }
  return true;
}

bool append_any(std::string_view group, std::vector<std::uint8_t>& bytes) {
  return append_group(group, bytes) || append_joined(group, bytes);
}

bool is_bytes(std::string_view word) {
  std::vector<std::uint8_t> bytes;
  return append_any(word, bytes);
}

// Returns whether a terminal program may show `bytes`, or only the first of them, as `text`.
bool is_text_of(std::string_view text, Bytes bytes) {
  std::string letters;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    // each character of the text, even of several bytes in UTF-8, stands for one logged byte
    if ((byte & 0xC0) != 0x80) letters += byte < 0x80 ? c : '.';
  }
  if (letters.empty() || letters.size() > bytes.size()) return false;
  for (std::size_t i = 0; i < letters.size(); ++i) {
    const bool printable = bytes[i] >= ' ' && bytes[i] < 0x7F;
    if (printable ? letters[i] != static_cast<char>(bytes[i])
                  : std::string_view(". _?~*").find(letters[i]) == std::string_view::npos) {
      return false;
    }
  }
  return true;
}

bool is_column(std::string_view text, Bytes bytes) {
  text = trim(text);
  if (text.size() >= 2 && text.front() == text.back() &&
      std::string_view("|\"'").find(text[0]) != std::string_view::npos) {
    text = text.substr(1, text.size() - 2);
  } else if (text.starts_with('|')) {
    text.remove_prefix(1);
  }
  if (is_text_of(text, bytes)) return true;
  // blanks at the beginning of the text were removed, so blanks at the beginning of the bytes are skipped
  while (!bytes.empty() && bytes[0] == ' ') bytes = bytes.subspan(1);
  return trim(text).empty() || is_text_of(trim(text), bytes);
}

// Parses the rest of a line: bytes, perhaps followed by their text.
bool take_bytes(std::string_view text, HexLine& parsed) {
  constexpr std::string_view between = " \t,;";
  for (;;) {
    const std::size_t gap = std::min(text.find_first_not_of(between), text.size());
    const bool only_blanks = text.find_first_not_of(blanks) == gap;
    const bool wide = only_blanks && (gap >= 2 || text.starts_with('\t'));
    text.remove_prefix(gap);
    if (text.empty()) return true;
    const std::string_view group = text.substr(0, text.find_first_of(separators));
    if (wide && is_bytes(group) && is_text_of(text, parsed.bytes)) {
      parsed.problem = quoted(text) + " may be bytes, or the text of those before it: leave it away";
      return false;
    }
    if (group.empty() || !append_any(group, parsed.bytes)) {
      const bool apart = wide || std::string_view("|\"'").find(text[0]) != std::string_view::npos;
      if (apart && is_column(text, parsed.bytes)) return true;
      parsed.problem = quoted(text) + " is neither bytes nor the text of the bytes before it";
      return false;
    }
    text.remove_prefix(group.size());
  }
}

// ---- Times

struct ParsedTime {
  std::optional<Instant> at;
  std::size_t size = 0;  // number of characters at the beginning of the line that state the time
};

// Returns the number of characters at the beginning of `text` that may be a clock time like "17:55:24.123".
std::size_t clock_size(std::string_view text) {
  std::size_t size = std::min(text.find_first_not_of("0123456789:."), text.size());
  const bool seconds = size > 3 && text[size - 3] == ':' && std::count(text.begin(), text.begin() + size, ':') == 2;
  // A comma after the seconds begins a fraction of a second only if three or six digits follow.
  if (seconds && text.substr(size).starts_with(',')) {
    const std::string_view behind = text.substr(size + 1);
    const std::size_t digits = std::min(behind.find_first_not_of("0123456789"), behind.size());
    const bool ends =
        digits == behind.size() || std::string_view(" \t])|;").find(behind[digits]) != std::string_view::npos;
    if (ends && (digits == 3 || digits == 6)) size += 1 + digits;
  }
  while (size > 0 && !is_digit(text[size - 1])) --size;  // a colon behind the time, "17:55:24:", is no part of it
  return size;
}

ParsedTime match_clock(std::string_view text, const std::string& date) {
  std::size_t size = clock_size(text);
  std::string clock(text.substr(0, size));
  if (clock.size() > 1 && clock[1] == ':') clock.insert(0, "0");
  if (clock.size() < 8 || clock[2] != ':' || clock[5] != ':') return {};
  if (clock.size() > 8 && (clock[8] == ',' || clock[8] == ':')) clock[8] = '.';
  std::string_view rest = text.substr(size);
  const std::string_view half = take_word(rest);
  const std::string lower = lower_case(half);
  if (lower == "am" || lower == "pm") {
    const int hour = (clock[0] - '0') * 10 + clock[1] - '0';
    const int of_day = hour % 12 + (lower == "pm" ? 12 : 0);
    clock[0] = static_cast<char>('0' + of_day / 10);
    clock[1] = static_cast<char>('0' + of_day % 10);
    size = static_cast<std::size_t>(half.data() + half.size() - text.data());
  }
  if (text.substr(size).starts_with('Z')) ++size;
  return {parse_clock(date.empty() ? clock : date + ' ' + clock), size};
}

// Returns the date at the beginning of `text` in the form "2026-11-21"; "" if there is none.
std::string match_date(std::string_view text) {
  if (text.size() < 10) return "";
  text = text.substr(0, 10);
  const auto part = [&](std::size_t at, std::size_t size) { return std::string(text.substr(at, size)); };
  const auto fits = [&](std::size_t first, std::size_t second) {
    for (std::size_t i = 0; i < 10; ++i) {
      if (i == first || i == second ? std::string_view("-/.").find(text[i]) == std::string_view::npos
                                    : !is_digit(text[i])) {
        return false;
      }
    }
    return text[first] == text[second];
  };
  if (fits(4, 7)) return part(0, 4) + "-" + part(5, 2) + "-" + part(8, 2);
  if (!fits(2, 5)) return "";
  const bool month_first = text[2] == '/' && part(3, 2) > "12";
  return part(6, 4) + "-" + (month_first ? part(0, 2) : part(3, 2)) + "-" + (month_first ? part(3, 2) : part(0, 2));
}

// Parses a time like "12.000250" (seconds) or "250us"; returns nothing for another word.
std::optional<Instant> parse_count(std::string_view word) {
  struct TimeUnit {
    std::string_view suffix;
    std::string_view power;
  };
  constexpr std::array<TimeUnit, 4> units = {{{"ms", "e-3"}, {"us", "e-6"}, {"ns", "e-9"}, {"s", ""}}};
  for (const TimeUnit& unit : units) {
    if (!word.ends_with(unit.suffix) || word.size() > 40) continue;
    return parse_seconds(std::string(word.substr(0, word.size() - unit.suffix.size())) + std::string(unit.power));
  }
  return word.find('.') == std::string_view::npos ? std::nullopt : parse_seconds(word);
}

ParsedTime match_time(std::string_view text) {
  const std::string_view iso = text.substr(0, text.find_first_of(" \t,;|])"));
  if (iso.size() > 11 && iso[10] == 'T') {
    const std::string_view stamp = iso.ends_with(':') ? iso.substr(0, iso.size() - 1) : iso;
    return {parse_clock(stamp), iso.size()};
  }
  if (const std::string date = match_date(text); !date.empty()) {
    const std::size_t gap = text.find_first_not_of(" \t,", 10);
    if (gap == std::string_view::npos || gap == 10) return {};
    ParsedTime taken = match_clock(text.substr(gap), date);
    taken.size += gap;
    return taken;
  }
  if (const ParsedTime clock = match_clock(text, ""); clock.at) return clock;
  const std::string_view word = text.substr(0, text.find_first_of(separators));
  return {parse_count(word.ends_with(':') ? word.substr(0, word.size() - 1) : word), word.size()};
}

// ---- Words

constexpr std::size_t most_words = 13;
constexpr std::array<std::array<std::string_view, most_words>, 2> directions = {
    {{"tx", "out", "host", "sent", "send", "write", "written", "request", "txd", "w", "pc", "to", "output"},
     {"rx", "in", "device", "received", "recv", "read", "receive", "reply", "rxd", "r", "encoder", "from", "input"}}};
constexpr std::array<std::array<std::string_view, 4>, 2> arrows = {
    {{"-->", "->", ">>", ">"}, {"<--", "<-", "<<", "<"}}};

int direction_of(std::string_view word) {
  std::string lower = lower_case(word);
  if (lower.starts_with("tx") || lower.starts_with("rx")) {  // "RX1" is a direction like "RX"
    while (lower.size() > 2 && is_digit(lower.back())) lower.pop_back();
  }
  for (std::size_t i = 0; i < directions.size(); ++i) {
    if (std::find(directions[i].begin(), directions[i].end(), lower) != directions[i].end()) return static_cast<int>(i);
  }
  return -1;
}

bool is_port(std::string_view word) {
  const std::string lower = lower_case(word);
  if (lower.starts_with("/dev/") || lower.starts_with("\\\\.\\")) return true;
  for (const std::string_view kind : {"com", "tty", "cu.", "uart", "serial", "port"}) {
    if (!lower.starts_with(kind) || lower.size() == kind.size()) continue;
    if (kind == "tty" || kind == "cu." || all_digits(lower.substr(kind.size()))) return true;
  }
  return false;
}

// Returns whether the word is a line number, a length, or a word like "data".
bool is_filler(std::string_view word) {
  const std::string lower = lower_case(word);
  if (all_digits(lower)) return true;
  for (const std::string_view kind : {"len", "length", "size", "count", "n"}) {
    if (lower == kind || (lower.starts_with(kind) && lower.size() > kind.size() + 1 && lower[kind.size()] == '='))
      return true;
  }
  return lower == "byte" || lower == "bytes" || lower == "data" || lower == "hex" || lower == "-";
}

/// The parser of a log line: time, direction, port and fillers in any order, then the bytes.
class Prefix {
 public:
  Prefix(std::string_view text, HexLine& parsed) : text_(text), parsed_(parsed) {}

  bool read() {
    for (bool first = true;; first = false) {
      skip_separators();
      if (text_.empty()) return has_something();
      if (take_time() || take_arrow()) continue;
      if (!parsed_.problem.empty()) return false;
      if (text_[0] == '[' || text_[0] == '(') {
        if (take_bracket()) return true;
        if (!parsed_.problem.empty()) return false;
        continue;
      }
      const std::string_view word = text_.substr(0, text_.find_first_of(separators));
      if (is_bytes(word)) {
        if (take_bytes(text_, parsed_)) return true;
        if (!all_digits(word) || !(is_count(word) || (first && !bytes_follow(word)))) return false;
        parsed_.bytes.clear();
        parsed_.problem.clear();
        text_.remove_prefix(word.size());
      } else if (!take_word_of_prefix(word)) {
        return false;
      }
    }
  }

 private:
  bool has_something() {
    if (parsed_.at || parsed_.channel >= 0 || !parsed_.source.empty()) return true;
    parsed_.problem = "a line without bytes";
    return false;
  }

  void skip_separators() {
    for (;;) {
      text_.remove_prefix(std::min(text_.find_first_not_of(separators), text_.size()));
      const bool alone = text_.size() == 1 || (text_.size() > 1 && blanks.find(text_[1]) != std::string_view::npos);
      if (!alone || (text_[0] != '-' && text_[0] != ':')) return;
      text_.remove_prefix(1);
    }
  }

  bool take_time() {
    if (parsed_.at) return false;
    const ParsedTime taken = match_time(text_);
    if (!taken.at) return false;
    const std::string_view clock = text_.substr(0, taken.size);
    const bool nothing_behind = trim(text_.substr(taken.size)).empty();
    if (nothing_behind && is_bytes(clock)) {
      parsed_.problem = quoted(clock) + " may be a time or bytes: write bytes with blanks between them";
      return false;
    }
    parsed_.at = taken.at;
    text_.remove_prefix(taken.size);
    if (text_.starts_with(':')) text_.remove_prefix(1);
    return true;
  }

  bool set_direction(int direction) {
    if (parsed_.channel >= 0 && parsed_.channel != direction) {
      parsed_.problem = "it has two directions";
      return false;
    }
    parsed_.channel = direction;
    return true;
  }

  bool take_arrow() {
    for (std::size_t i = 0; i < arrows.size(); ++i) {
      for (const std::string_view arrow : arrows[i]) {
        if (!text_.starts_with(arrow)) continue;
        text_.remove_prefix(arrow.size());
        if (text_.starts_with(':')) text_.remove_prefix(1);
        return set_direction(static_cast<int>(i));
      }
    }
    return false;
  }

  void add_source(std::string_view name) {
    if (!parsed_.source.empty()) parsed_.source += ' ';
    parsed_.source += name;
  }

  // Handles a word before the bytes: a direction, port, filler or label. Returns false if the word causes a problem.
  bool take_word_of_prefix(std::string_view word) {
    text_.remove_prefix(word.size());
    const bool label = word.ends_with(':') || word.ends_with('=');
    if (label) word.remove_suffix(1);
    if (const int direction = direction_of(word); direction >= 0) return set_direction(direction);
    if (is_filler(word)) return true;
    const std::size_t arrow = word.find_last_not_of("<>-");
    const std::string_view name = word.substr(0, arrow + 1);
    if (name.size() < word.size() && (is_port(name) || direction_of(name) >= 0)) {
      if (is_port(name)) add_source(name);
      const bool rather = direction_of(name) >= 0;  // in "RX>" the arrow is part of the word
      return set_direction(rather ? direction_of(name) : word.back() == '>' ? 0 : 1);
    }
    if (is_port(word) || label) {
      add_source(word);
      return true;
    }
    parsed_.problem = quoted(word) + " before the bytes is no time, port or direction";
    return false;
  }

  // Handles text in brackets; returns true if it contains the bytes with which the line ends.
  bool take_bracket() {
    const char closing = text_[0] == '[' ? ']' : ')';
    const std::size_t end = text_.find(closing);
    if (end == std::string_view::npos) {
      parsed_.problem = quoted(text_) + " has a bracket that nothing closes";
      return false;
    }
    const std::string_view inner = trim(text_.substr(1, end - 1));
    text_.remove_prefix(end + 1);
    if (text_.starts_with(':')) text_.remove_prefix(1);
    if (trim(text_).empty()) return take_bytes(inner, parsed_);
    if (is_bytes(inner.substr(0, inner.find_first_of(separators))) && !is_filler(inner) &&
        inner.find("byte") == std::string_view::npos && !match_time(inner).at) {
      parsed_.problem = quoted(inner) + " in brackets may be bytes, or none";
      return false;
    }
    HexLine inner_line;
    Prefix inside(inner, inner_line);
    if (!inside.read() || !inner_line.bytes.empty()) {  // brackets without known content, "[main loop]", are a source
      if (!is_filler(inner) && inner.find("byte") == std::string_view::npos) add_source(inner);
      return false;
    }
    if (inner_line.at) parsed_.at = inner_line.at;
    if (!inner_line.source.empty()) add_source(inner_line.source);
    if (inner_line.channel >= 0) static_cast<void>(set_direction(inner_line.channel));
    return false;
  }

  // Returns whether the word is a number of bytes, as in "11 bytes".
  [[nodiscard]] bool is_count(std::string_view word) const {
    return lower_case(trim(text_.substr(word.size()))).starts_with("byte");
  }

  // Returns whether bytes, or nothing at all, follow the word.
  [[nodiscard]] bool bytes_follow(std::string_view word) const {
    std::string_view rest = text_.substr(word.size());
    rest.remove_prefix(std::min(rest.find_first_not_of(separators), rest.size()));
    return rest.empty() || is_bytes(rest.substr(0, rest.find_first_of(separators)));
  }

  std::string_view text_;
  HexLine& parsed_;
};

}  // namespace

bool parse_log_line(std::string_view line, HexLine& parsed) { return Prefix(trim(line), parsed).read(); }

}  // namespace absenc::capture
