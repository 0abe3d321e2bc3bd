// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/candump.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "absenc/capture/files/parsed_reader.hpp"

namespace absenc::capture {

namespace {

constexpr std::size_t block_frames = 1 << 14;
constexpr std::uint64_t times_examined = 1 << 16;

bool parse_identifier(std::string_view text, CanRecord& record) {
  if (text.size() != 3 && text.size() != 8) return false;
  std::uint32_t id = 0;
  for (const char c : text) {
    if (hex_digit(c) < 0) return false;
    id = id << 4 | static_cast<std::uint32_t>(hex_digit(c));
  }
  constexpr std::uint32_t error_flag = 0x20000000;  // the kernel's flag for error frames, CAN_ERR_FLAG
  record.frame.extended = text.size() == 8;
  record.error_frame = record.frame.extended && (id & error_flag) != 0;
  record.frame.id = id & (record.frame.extended ? 0x1FFFFFFF : 0x7FF);
  return record.frame.extended || id <= 0x7FF;
}

bool append_byte(std::string_view digits, CanFrame& frame) {
  if (digits.size() != 2 || hex_digit(digits[0]) < 0 || hex_digit(digits[1]) < 0 || frame.size == 8) return false;
  frame.data[frame.size++] = static_cast<std::uint8_t>(hex_digit(digits[0]) << 4 | hex_digit(digits[1]));
  return true;
}

// Parses the part of a log line after '#', like "R", "R4" (remote frames), "1122" or "11.22".
bool parse_compact(std::string_view data, CanFrame& frame) {
  if (data.size() >= 2 && data[data.size() - 2] == '_' && hex_digit(data.back()) > 8) data.remove_suffix(2);
  if (data.starts_with('R')) {
    frame.remote = true;
    if (data.size() == 1) return true;
    frame.size = static_cast<std::uint8_t>(data[1] - '0');
    return data.size() == 2 && data[1] >= '0' && data[1] <= '8';
  }
  while (!data.empty()) {
    if (!append_byte(data.substr(0, 2), frame)) return false;
    data.remove_prefix(2);
    if (data.starts_with('.')) data.remove_prefix(1);
  }
  return true;
}

bool parse_log(std::string_view identifier, std::string_view data, CandumpLine& parsed) {
  if (data.starts_with('#') || data.find(':') != std::string_view::npos) {
    parsed.kind = CandumpLine::Kind::other_can;
    return true;
  }
  return parse_identifier(identifier, parsed.record) && parse_compact(data, parsed.record.frame);
}

// Parses the text behind the identifier in a line of screen output, like "[3]  11 22 33".
bool parse_screen(std::string_view rest, CandumpLine& parsed) {
  const std::string_view length = take_word(rest);
  if (length.size() == 4 && length.front() == '[') {  // a length with two digits, "[08]", is CAN FD
    parsed.kind = CandumpLine::Kind::other_can;
    return true;
  }
  if (length.size() != 3 || length[0] != '[' || length[2] != ']' || length[1] < '0' || length[1] > '8') return false;
  const auto size = static_cast<std::uint8_t>(length[1] - '0');
  CanFrame& frame = parsed.record.frame;
  std::string_view more = rest;
  if (take_word(more) == "remote") {
    frame.remote = true;
    frame.size = size;
    return take_word(more) == "request" && trim(more).empty();
  }
  while (frame.size < size) {
    if (!append_byte(take_word(rest), frame)) return false;
  }
  rest = trim(rest);
  return rest.empty() || rest.front() == '\'' || rest == "ERRORFRAME";
}

bool is_flag(std::string_view word) {
  return word == "RX" || word == "TX" || word == "-" || word == "B" || word == "E";
}

class CandumpReader final : public ParsedReader {
 public:
  CandumpReader(std::unique_ptr<Source> source, std::string_view name) : source_(std::move(source)), lines_(*source_) {
    layout_.content = Content::frames;
    look_ahead(name);
    if (timed_) layout_.ticks_per_second = 1'000'000'000;
  }

  [[nodiscard]] bool claim(Block& block) override {
    if (done_) return false;
    begin_block(block, index_++, at_);
    while (block.frames.size() < block_frames) {
      if (!take_line(block)) {
        done_ = true;
        others_.report(damages_, "frames of CAN FD or CAN XL are left out");
        unknown_frames_.report(damages_,
                               "frames are of interfaces that the first 64 KiB do not name, and left out; the first: " +
                                   unknown_interface_);
        break;
      }
    }
    // The first frame of the next block may have the same time as the last frame of this block.
    block.end = at_ + (timed_ && done_ ? 1 : 0);
    return true;
  }

 private:
  // Finds in the first 64 KiB of the file the names of the interfaces, and whether each time counts from the previous
  // frame.
  void look_ahead(std::string_view name) {
    TextLines lines(*source_);
    std::string_view line;
    CandumpLine parsed;
    std::optional<Instant> last;
    std::string last_channel;
    bool first = true;
    bool rises = true;
    while (lines.next(line) && lines.offset() < times_examined) {
      if (trim(line).empty()) continue;
      if (!parse_candump(line, parsed)) break;
      if (std::exchange(first, false)) timed_ = parsed.timed;
      if (find(parsed.channel) == layout_.channels.size() && layout_.channels.size() < 255) {
        layout_.channels.emplace_back(parsed.channel);
      }
      // If no time counts from the previous frame, only frames of different interfaces may have the same time.
      const bool zero = parsed.at.seconds == 0 && parsed.at.picoseconds == 0;
      constexpr std::int64_t day = 86400;
      if (last && !zero && parsed.at.seconds < day) {
        const std::optional<Tick> passed = ticks_between(*last, parsed.at, nanosecond);
        rises = rises && passed && (*passed != 0 || parsed.channel != last_channel);
      }
      last = parsed.at;
      last_channel = parsed.channel;
    }
    if (first) throw OpenError(std::string(name) + " holds no frames that candump printed");
    deltas_ = timed_ && !rises;
  }

  [[nodiscard]] std::size_t find(std::string_view channel) const {
    return static_cast<std::size_t>(std::find(layout_.channels.begin(), layout_.channels.end(), channel) -
                                    layout_.channels.begin());
  }

  bool fail(std::string what) {
    damages_.add({.offset = lines_.offset(), .tick = at_, .what = std::move(what)});
    return false;
  }

  bool take_line(Block& block) {
    std::string_view line;
    if (!lines_.next(line)) return lines_.too_long() ? fail("a line of more than 1 MiB is none of candump's") : false;
    if (trim(line).empty()) return true;
    CandumpLine parsed;
    if (!parse_candump(line, parsed) || parsed.timed != timed_) {
      return fail("this line is none that candump prints, or other than the first: is the file cut here?");
    }
    if (timed_ && !advance(parsed.at)) {
      return fail("the time runs backwards: were two logs put together?");
    }
    const std::size_t channel = find(parsed.channel);
    if (parsed.kind == CandumpLine::Kind::other_can) {
      others_.add(lines_.offset(), at_);
    } else if (channel == layout_.channels.size()) {
      if (unknown_frames_.count == 0) unknown_interface_ = parsed.channel.substr(0, 32);
      unknown_frames_.add(lines_.offset(), at_);
    } else {
      parsed.record.at = at_;
      parsed.record.channel = static_cast<std::uint8_t>(channel);
      block.frames.push_back(parsed.record);
    }
    return true;
  }

  bool advance(const Instant& at) {
    if (!origin_) origin_ = deltas_ ? Instant{} : at;
    const std::optional<Tick> ticks = ticks_between(*origin_, at, nanosecond);
    if (!ticks) return false;
    if (deltas_) {
      const Tick step = std::exchange(any_, true) ? *ticks : 0;
      if (step > std::numeric_limits<Tick>::max() - 1 - at_) return false;
      at_ += step;
      return true;
    }
    if (*ticks < at_) return false;
    at_ = *ticks;
    return true;
  }

  std::unique_ptr<Source> source_;
  TextLines lines_;
  bool timed_ = false;
  bool deltas_ = false;
  bool any_ = false;
  bool done_ = false;
  std::optional<Instant> origin_;
  std::uint64_t index_ = 0;
  Tick at_ = 0;
  std::string unknown_interface_;
  Occurrences others_;
  Occurrences unknown_frames_;
};

}  // namespace

bool parse_candump(std::string_view line, CandumpLine& parsed) {
  parsed = {};
  line = trim(line);
  if (line.starts_with('(')) {
    const std::size_t close = line.find(')');
    if (close == std::string_view::npos) return false;
    const std::string_view time = line.substr(1, close - 1);
    const auto at = time.find(':') == std::string_view::npos ? parse_seconds(time) : parse_clock(time);
    if (!at) return false;
    parsed.timed = true;
    parsed.at = *at;
    line.remove_prefix(close + 1);
  }
  parsed.channel = take_word(line);
  std::string_view word = take_word(line);
  if (const std::size_t hash = word.find('#'); hash != std::string_view::npos) {
    line = trim(line);
    // newer logs end lines with R (received) or T (transmitted)
    if (!line.empty() && line != "R" && line != "T") return false;
    return parse_log(word.substr(0, hash), word.substr(hash + 1), parsed);
  }
  while (is_flag(word)) word = take_word(line);
  return parse_identifier(word, parsed.record) && parse_screen(line, parsed);
}

std::unique_ptr<Reader> read_candump(std::unique_ptr<Source> source, std::string_view name) {
  return std::make_unique<CandumpReader>(std::move(source), name);
}

}  // namespace absenc::capture
