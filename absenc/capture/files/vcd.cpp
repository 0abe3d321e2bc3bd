// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/vcd.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "absenc/capture/files/level_writer.hpp"
#include "absenc/capture/files/parsed_reader.hpp"
#include "absenc/capture/files/text_lines.hpp"
#include "absenc/capture/files/text_words.hpp"
#include "absenc/capture/files/vcd_header.hpp"

namespace absenc::capture {

namespace {

constexpr std::uint64_t block_text = 1 << 20;
// number of changes after which a block ends at the next time; one identifier may drive many channels
constexpr std::size_t block_changes = 1 << 20;

enum class Value : std::uint8_t { low, high, unknown, none };

constexpr Value to_value(char c) {
  switch (c) {
    case '0':
    case 'l':
    case 'L':
      return Value::low;
    case '1':
    case 'h':
    case 'H':
      return Value::high;
    case 'x':
    case 'X':
    case 'z':
    case 'Z':
    case 'u':
    case 'U':
    case 'w':
    case 'W':
    case '-':
      return Value::unknown;
    default:
      return Value::none;
  }
}

class VcdReader final : public ParsedReader {
 public:
  VcdReader(std::unique_ptr<Source> source, std::string_view name)
      : source_(std::move(source)), words_(*source_), header_(words_, name), levels_(header_.channels().size()) {
    layout_.content = Content::changes;
    layout_.channels = header_.channels();
    layout_.ticks_per_second = header_.ticks_per_second();
    if (header_.left_out() != 0) {
      damages_.add(
          {.what = std::to_string(header_.left_out()) + " variables that are no wires or registers are left out",
           .note = true});
    }
  }

  [[nodiscard]] bool claim(Block& block) override {
    if (done_) return false;
    begin_block(block, index_++, now_);
    levels_.begin(block);
    const std::uint64_t begin = words_.offset();
    for (;;) {
      const std::string_view word = words_.next();
      if (word.empty()) {
        if (words_.too_long()) fail("a word of more than 64 KiB is no value change");
        break;
      }
      if (word[0] != '#') {
        if (!take(word)) break;
        continue;
      }
      Tick time = 0;
      if (!parse_time(word.substr(1), time)) break;
      last_changed_ = false;
      if (!started_ || (initial_ && !valued_)) {
        started_ = true;
        now_ = time;
        block.first = now_;
        continue;
      }
      initial_ = initial_ && time == now_;
      const bool later = time != now_;
      now_ = time;
      if (later && (words_.offset() - begin >= block_text || levels_.changes() >= block_changes)) {
        block.end = now_;
        return true;
      }
    }
    done_ = true;
    // If the last time of the file is followed by values, the capture ends one tick after it, to include them.
    block.end = std::max(block.first, now_ + (last_changed_ ? 1 : 0));
    unknown_.report(damages_, "values are x or z: taken as the level before");
    return true;
  }

 private:
  bool fail(std::string what) {
    damages_.add({.offset = words_.offset(), .tick = now_, .what = std::move(what)});
    return false;
  }

  bool parse_time(std::string_view digits, Tick& time) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), time);
    if (error != std::errc() || end != digits.data() + digits.size() || time == std::numeric_limits<Tick>::max()) {
      return fail("this is no time: is the file damaged?");
    }
    if (started_ && time < now_) {
      return fail("the time runs backwards, from " + std::to_string(now_) + " to " + std::to_string(time) +
                  ": were two captures put together?");
    }
    return true;
  }

  // Handles a word that begins a value change or a section; returns false if it is damaged.
  bool take(std::string_view word) {
    if (word[0] == '$') return take_section(word);
    started_ = true;
    valued_ = true;
    last_changed_ = true;
    if (to_value(word[0]) != Value::none) return change(word.substr(1), word.substr(0, 1), words_.offset());
    switch (word[0]) {
      case 'b':
      case 'B': {
        vector_.assign(word.substr(1));
        const std::uint64_t offset = words_.offset();
        return change(words_.next(), vector_, offset);
      }
      case 'r':
      case 'R':
      case 's':
      case 'S':
        return header_.find(words_.next()) != nullptr || fail_identifier();
      default:
        return fail("this is no value change: is the file damaged?");
    }
  }

  bool take_section(std::string_view word) {
    constexpr std::array<std::string_view, 5> open = {"$dumpvars", "$dumpall", "$dumpon", "$dumpoff", "$end"};
    if (std::find(open.begin(), open.end(), word) != open.end()) return true;
    for (std::string_view inner = words_.next(); inner != "$end"; inner = words_.next()) {
      if (inner.empty()) return fail("the file ends within a section: is it cut off?");
    }
    return true;
  }

  bool fail_identifier() {
    return fail("the header declares no such identifier: is the file damaged or cut off here?");
  }

  bool change(std::string_view identifier, std::string_view bits, std::uint64_t offset) {
    const std::vector<VcdVariable>* variables = header_.find(identifier);
    if (variables == nullptr || bits.empty()) return fail_identifier();
    for (const VcdVariable& variable : *variables) {
      if (variable.width == 1 && bits.size() == 1) {
        if (!change_bit(variable.first, to_value(bits[0]), offset)) return false;
      } else if (!change_vector(variable, bits, offset)) {
        return false;
      }
    }
    return true;
  }

  // Sets the bits of a vector. A vector may be written with fewer bits than it has: the missing upper bits are unknown
  // if the first written bit is unknown, otherwise 0.
  bool change_vector(const VcdVariable& variable, std::string_view bits, std::uint64_t offset) {
    const Value extension = to_value(bits[0]) == Value::unknown ? Value::unknown : Value::low;
    for (std::size_t i = 0; i < std::max(variable.width, bits.size()); ++i) {
      const Value value = i < bits.size() ? to_value(bits[bits.size() - 1 - i]) : extension;
      if (value == Value::none) return fail("a vector has a bit that is none: is the file damaged?");
      if (i < variable.width && !change_bit(variable.first + i, value, offset)) return false;
    }
    return true;
  }

  bool change_bit(std::size_t channel, Value value, std::uint64_t offset) {
    if (value == Value::none) return fail("this is no value: is the file damaged?");
    if (value == Value::unknown) {
      unknown_.add(offset, now_);
    } else if (initial_) {
      levels_.start(channel, value == Value::high);
    } else {
      levels_.set(channel, value == Value::high, now_);
    }
    return true;
  }

  std::unique_ptr<Source> source_;
  TextWords words_;
  VcdHeader header_;
  LevelWriter levels_;
  std::string vector_;
  std::uint64_t index_ = 0;
  Tick now_ = 0;
  bool started_ = false;  // true: a time or a value change has been read from the file
  bool valued_ = false;   // true: a value change has been read from the file
  bool initial_ = true;   // true: all values read so far have the time of the first one, so they are initial levels
  bool last_changed_ = false;
  bool done_ = false;
  Occurrences unknown_;
};

}  // namespace

bool is_vcd(std::string_view head) {
  constexpr std::array<std::string_view, 8> keywords = {"$date",  "$version", "$timescale", "$comment",
                                                        "$scope", "$var",     "$upscope",   "$enddefinitions"};
  head = trim(head);
  head = head.substr(0, head.find_first_of(" \t\r\n"));
  return std::find(keywords.begin(), keywords.end(), head) != keywords.end();
}

std::unique_ptr<Reader> read_vcd(std::unique_ptr<Source> source, std::string_view name) {
  return std::make_unique<VcdReader>(std::move(source), name);
}

}  // namespace absenc::capture
