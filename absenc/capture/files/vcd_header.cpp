// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/vcd_header.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <map>
#include <set>
#include <utility>

namespace absenc::capture {

namespace {

constexpr std::size_t most_channels = 1 << 16;
constexpr std::size_t longest_name = 1 << 12;
constexpr std::uint64_t longest_header = std::uint64_t{1} << 26;

bool is_net(std::string_view type) {
  constexpr std::array<std::string_view, 16> nets = {"wire", "reg",     "logic",   "bit",   "port",   "tri",
                                                     "tri0", "tri1",    "triand",  "trior", "trireg", "wand",
                                                     "wor",  "supply0", "supply1", "uwire"};
  return std::find(nets.begin(), nets.end(), type) != nets.end();
}

bool parse(std::string_view text, long& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

// Parses the index range of a variable, "[7:0]" or "[3]"; returns false if `text` is no range.
bool parse_range(std::string_view text, long& left, long& right) {
  if (text.size() < 3 || text.front() != '[' || text.back() != ']') return false;
  text = text.substr(1, text.size() - 2);
  const std::size_t colon = text.find(':');
  if (!parse(text.substr(0, colon), left)) return false;
  right = left;
  return colon == std::string_view::npos || parse(text.substr(colon + 1), right);
}

// Returns the ticks per second of a time scale like "10ns"; 0 if it is invalid.
std::uint64_t parse_timescale(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || (number != 1 && number != 10 && number != 100)) return 0;
  const std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
  constexpr std::array<std::string_view, 6> units = {"s", "ms", "us", "ns", "ps", "fs"};
  std::uint64_t per_second = 1;
  for (const std::string_view one : units) {
    if (unit == one) return per_second % number == 0 ? per_second / number : 0;
    per_second *= 1000;
  }
  return 0;
}

}  // namespace

VcdHeader::VcdHeader(TextWords& words, std::string_view name)
    : words_(words), name_(name), short_(short_codes + 1, -1) {
  short_.resize(short_codes);
  for (;;) {
    const std::string keyword = next("before $enddefinitions");
    if (!keyword.starts_with('$')) fail("has a word outside of any section of its header: " + keyword.substr(0, 20));
    read_section(keyword);
    if (keyword == "$enddefinitions") break;
    if (words_.offset() - comments_ > longest_header) fail("has a header of more than 64 MiB");
  }
  if (ticks_per_second_ == 0) fail("does not tell its unit of time: it has no $timescale");
  if (names_.empty()) fail("declares no channels: it has no $var of a wire or register");
  name_channels();
}

void VcdHeader::read_section(std::string_view keyword) {
  if (keyword == "$timescale") {
    read_timescale();
  } else if (keyword == "$scope") {
    read_scope();
  } else if (keyword == "$upscope") {
    if (!scopes_.empty()) scopes_.pop_back();
    skip_to_end();
  } else if (keyword == "$var") {
    read_variable();
  } else if (keyword == "$comment") {
    const std::uint64_t begin = words_.offset();
    skip_to_end();
    comments_ += words_.offset() - begin;
  } else if (keyword != "$end") {
    skip_to_end();
  }
}

void VcdHeader::read_timescale() {
  std::string text;
  for (std::string word = next("in $timescale"); word != "$end"; word = next("in $timescale")) {
    if (text.size() < 32) text += word;
  }
  ticks_per_second_ = parse_timescale(text);
  if (ticks_per_second_ == 0) {
    fail("has a $timescale that is not 1, 10 or 100 of s, ms, us, ns, ps or fs, or longer than 1 s: " + text);
  }
}

void VcdHeader::read_scope() {
  // skips the word after $scope, which states the type of the scope (module, task ...)
  static_cast<void>(next("in $scope"));
  const std::string scope = next("in $scope");
  if (scope == "$end") return scopes_.push_back(scopes_.empty() ? "" : scopes_.back());
  std::string path = scopes_.empty() ? scope : scopes_.back() + "." + scope;
  if (path.size() > longest_name) fail("has a scope with a name of more than 4096 characters");
  scopes_.push_back(std::move(path));
  if (scopes_.size() > 1000) fail("has scopes that are more than 1000 deep");
  skip_to_end();
}

void VcdHeader::read_variable() {
  const std::string type = next("in $var");
  long width = 0;
  const bool has_width = parse(next("in $var"), width);
  const std::string identifier = next("in $var");
  std::string name = next("in $var");
  long left = width - 1;
  long right = 0;
  bool ranged = false;
  for (std::string word = next("in $var"); word != "$end"; word = next("in $var")) {
    ranged = parse_range(word, left, right) || ranged;
  }
  if (name.size() > longest_name) fail("has a variable with a name of more than 4096 characters");
  std::vector<VcdVariable>& variables = declare(identifier);
  if (!is_net(type)) {
    ++left_out_;
    return;
  }
  if (!has_width || width < 1 || names_.size() + static_cast<std::size_t>(width) > most_channels) {
    fail("declares " + name.substr(0, 80) + " with an impossible width, or more than 65536 channels in all");
  }
  // If the width of the index range differs from the width of the variable, the range is the index of an array element.
  if (std::abs(left - right) != width - 1) {
    name += ranged ? "[" + std::to_string(left) + "]" : "";
    left = width - 1;
    right = 0;
  } else if (const std::size_t bracket = name.find('['); !ranged && bracket != std::string::npos) {
    long first = 0;
    long last = 0;  // the range may be part of the name: "data[7:0]"
    if (parse_range(std::string_view(name).substr(bracket), first, last) && std::abs(first - last) == width - 1) {
      ranged = true;
      left = first;
      right = last;
      name.resize(bracket);
    }
  }
  const std::string scope = scopes_.empty() ? "" : scopes_.back();
  variables.push_back({names_.size(), static_cast<std::size_t>(width)});
  for (long i = 0; i < width; ++i) {
    const long index = right <= left ? right + i : right - i;
    names_.push_back({scope, name, ranged || width > 1 ? "[" + std::to_string(index) + "]" : ""});
  }
}

std::string VcdHeader::next(std::string_view where) {
  const std::string_view word = words_.next();
  if (word.empty()) fail("ends " + std::string(where) + ": is it cut off?");
  return std::string(word);
}

void VcdHeader::skip_to_end() {
  for (std::string_view word = words_.next(); word != "$end"; word = words_.next()) {
    if (word.empty()) fail("ends within a section of its header: is it cut off?");
  }
}

std::vector<VcdVariable>& VcdHeader::declare(const std::string& identifier) {
  const std::size_t code = short_code(identifier);
  std::size_t index = variables_.size();
  if (code < short_.size()) {
    if (short_[code] < 0) short_[code] = static_cast<std::int32_t>(index);
    index = static_cast<std::size_t>(short_[code]);
  } else {
    index = long_.try_emplace(identifier, index).first->second;
  }
  if (index == variables_.size()) variables_.emplace_back();
  return variables_[index];
}

void VcdHeader::name_channels() {
  std::map<std::string, std::set<std::string>> scopes;
  for (const Name& one : names_) scopes[one.name + one.suffix].insert(one.scope);
  channels_.reserve(names_.size());
  for (const Name& one : names_) {
    const bool ambiguous = scopes[one.name + one.suffix].size() > 1 && !one.scope.empty();
    channels_.push_back((ambiguous ? one.scope + "." : "") + one.name + one.suffix);
  }
  names_.clear();
}

void VcdHeader::fail(const std::string& what) const {
  throw OpenError(name_ + " " + what + " (byte " + std::to_string(words_.offset()) + ")");
}

}  // namespace absenc::capture
