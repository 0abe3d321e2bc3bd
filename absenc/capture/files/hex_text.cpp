// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/hex_text.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "absenc/capture/files/hex_line.hpp"
#include "absenc/capture/files/parsed_reader.hpp"
#include "absenc/capture/files/text_lines.hpp"

namespace absenc::capture {

namespace {

constexpr std::size_t bytes_at_once = 1 << 16;

// Returns `line` without its comment. In a dump the text beside the bytes may contain any character, so `#` begins no
// comment.
std::string_view content_of(std::string_view line, std::optional<HexForm> form) {
  if (form == HexForm::dump || form == HexForm::xxd) return trim(line);
  return strip_comment(line);
}

std::optional<HexForm> first_form(std::string_view line) {
  if (strip_comment(line).empty()) return std::nullopt;
  if (const auto whole = hex_form(trim(line)); whole && *whole != HexForm::plain) return whole;
  return hex_form(strip_comment(line));
}

class HexTextReader final : public ParsedReader {
 public:
  HexTextReader(std::unique_ptr<Source> source, std::string_view name, std::uint64_t samples_per_second)
      : source_(std::move(source)), lines_(*source_) {
    layout_.content = Content::bytes;
    TextLines ahead(*source_);
    std::string_view line;
    while (ahead.next(line) && strip_comment(line).empty()) continue;
    const std::optional<HexForm> form = first_form(line);
    if (!form) throw OpenError(std::string(name) + " holds no bytes as text");
    form_ = *form;
    // A sigrok decoder may print annotations without bytes before the first line with bytes.
    constexpr std::uint64_t far_enough = 1 << 16;
    do {
      if (!parse_hex_line(form_, content_of(line, form_), line_)) break;
    } while (line_.bytes.empty() && ahead.offset() < far_enough && ahead.next(line));
    clock_ = line_.begin ? LineTime::samples : line_.at ? LineTime::times : LineTime::none;
    if (clock_ == LineTime::times) layout_.ticks_per_second = 1'000'000'000;
    if (clock_ == LineTime::samples) layout_.ticks_per_second = samples_per_second;
    if (line_.at) origin_ = *line_.at;
    has_direction_ = line_.channel >= 0;
    source_name_ = line_.source;
    if (has_direction_) layout_.channels = {"tx", "rx"};
  }

  [[nodiscard]] bool claim(Block& block) override {
    if (done_) return false;
    begin_block(block, index_++, clock_ == LineTime::none ? at_ : last_);
    while (block.bytes.size() < bytes_at_once) {
      if (!take_line(block)) {
        done_ = true;
        break;
      }
    }
    // The first line of the next block may begin at the same time as the last line of this block.
    block.end = done_ || clock_ == LineTime::none ? at_ : last_;
    return true;
  }

 private:
  enum class LineTime : std::uint8_t { none, times, samples };

  bool fail(const std::string& what) {
    damages_.add({.offset = lines_.offset(), .tick = at_, .what = what});
    return false;
  }

  bool take_line(Block& block) {
    std::string_view line;
    if (!lines_.next(line)) return lines_.too_long() ? fail("a line of more than 1 MiB: break it up") : false;
    line = content_of(line, form_);
    if (line.empty()) return true;
    if (!parse_hex_line(form_, line, line_)) {
      return fail(!line_.problem.empty()
                      ? line_.problem
                      : "this line does not hold bytes in the form of the first: is the file cut here?");
    }
    if (line_.bytes.empty()) {
      next_offset_ = line_.offset ? line_.offset : next_offset_;
      return true;
    }
    return check_offset() && append(block);
  }

  bool check_offset() {
    if (!line_.offset) return true;
    if (next_offset_ && *next_offset_ != *line_.offset && !std::exchange(jumped_, true)) {
      damages_.add({.offset = lines_.offset(),
                    .tick = at_,
                    .what = "the offsets of the dump jump: lines may be missing",
                    .note = true});
    }
    next_offset_ = *line_.offset + line_.bytes.size();
    return true;
  }

  bool append(Block& block) {
    const bool timed =
        clock_ == LineTime::times ? line_.at.has_value() : line_.begin.has_value() == (clock_ == LineTime::samples);
    if (!timed || (clock_ != LineTime::times && line_.at)) return fail("some lines have a time and some have none");
    if (has_direction_ != (line_.channel >= 0)) return fail("some lines have a direction and some have none");
    if (line_.source != source_name_) {
      return fail("this line is of \"" + line_.source + "\", the first of \"" + source_name_ +
                  "\": keep those of one, as with grep");
    }
    Tick begin = at_;
    if (clock_ == LineTime::times) {
      const auto ticks = ticks_between(origin_, *line_.at, nanosecond);
      if (!ticks) return fail("the time runs backwards");
      begin = *ticks;
    } else if (clock_ == LineTime::samples) {
      begin = *line_.begin;
    }
    if (begin < last_) return fail("the time runs backwards");
    last_ = begin;
    const auto channel = static_cast<std::uint8_t>(std::max(line_.channel, 0));
    for (const std::uint8_t value : line_.bytes) {
      const Tick end = clock_ == LineTime::times ? begin : clock_ == LineTime::samples ? line_.end : begin + 1;
      block.bytes.push_back({.begin = begin, .end = end, .value = value, .channel = channel});
      if (clock_ == LineTime::none) begin = end;
    }
    at_ = std::max(at_, block.bytes.back().end);
    return true;
  }

  std::unique_ptr<Source> source_;
  TextLines lines_;
  HexForm form_ = HexForm::plain;
  LineTime clock_ = LineTime::none;
  bool has_direction_ = false;
  std::string source_name_;
  bool jumped_ = false;
  bool done_ = false;
  Instant origin_;
  HexLine line_;
  std::optional<std::uint64_t> next_offset_;
  std::uint64_t index_ = 0;
  Tick at_ = 0;    // end of the latest byte, in ticks
  Tick last_ = 0;  // begin time of the previous line, in ticks
};

}  // namespace

std::string hex_text_problem(std::string_view head) {
  for (std::size_t lines = 0; !head.empty() && lines < 100; ++lines) {
    const std::string_view whole = head.substr(0, head.find('\n'));
    const std::string_view line = strip_comment(whole);
    HexLine parsed;
    if (!line.empty()) return parse_hex_line(HexForm::plain, line, parsed) ? "" : parsed.problem;
    head.remove_prefix(std::min(whole.size() + 1, head.size()));
  }
  return "";
}

bool is_hex_text(std::string_view head) {
  while (!head.empty()) {
    const std::string_view line = head.substr(0, head.find('\n'));
    if (!strip_comment(line).empty()) {
      // the head of the file ends within one long line, of which only a part is checked
      if (line.size() == head.size() && head.size() > 4096) {
        return first_form(head.substr(0, head.find_last_of(" ,;"))).has_value() ||
               first_form(head.substr(0, head.size() / 2 * 2)).has_value();
      }
      return first_form(line).has_value();
    }
    head.remove_prefix(std::min(line.size() + 1, head.size()));
  }
  return false;
}

std::unique_ptr<Reader> read_hex_text(std::unique_ptr<Source> source, std::string_view name,
                                      std::uint64_t samples_per_second) {
  return std::make_unique<HexTextReader>(std::move(source), name, samples_per_second);
}

}  // namespace absenc::capture
