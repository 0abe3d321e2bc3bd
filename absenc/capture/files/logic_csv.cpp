// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/logic_csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absenc/capture/files/level_writer.hpp"
#include "absenc/capture/files/parsed_reader.hpp"
#include "absenc/capture/files/text_lines.hpp"

namespace absenc::capture {

namespace {

constexpr std::uint64_t text_at_once = 1 << 20;
constexpr std::size_t most_columns = 1024;

struct TimeUnit {
  std::string_view name;
  std::uint64_t per_second;
};
constexpr std::array<TimeUnit, 5> time_units = {{{"seconds", 1},
                                                 {"milliseconds", 1'000},
                                                 {"microseconds", 1'000'000},
                                                 {"nanoseconds", 1'000'000'000},
                                                 {"picoseconds", 1'000'000'000'000}}};

const TimeUnit* find_unit(std::string_view name) {
  const auto* unit =
      std::find_if(time_units.begin(), time_units.end(), [&](const TimeUnit& one) { return one.name == name; });
  return unit == time_units.end() ? nullptr : unit;
}

std::string_view take_field(std::string_view& row) {
  // faster than `find`: most fields are a single digit, so the second character is mostly the comma
  const std::size_t comma = row.size() > 1 && row[1] == ',' ? 1 : row.find(',');
  const std::string_view field = row.substr(0, comma);
  row.remove_prefix(comma == std::string_view::npos ? row.size() : comma + 1);
  return field;
}

constexpr bool is_level(char c) { return c == '0' || c == '1' || c == 'X' || c == 'x'; }

bool begins_with_time(std::string_view line) { return line.starts_with("Time [s],") || line.starts_with("Time,"); }

bool names_kinds(std::string_view line) {
  const std::string_view first = line.substr(0, line.find(','));
  return first == "logic" || (first != line && (find_unit(first) != nullptr || first == "samples"));
}

// How the rows state their time: as seconds or a clock time, as a count of time units, or not at all (row number).
enum class RowTime : std::uint8_t { seconds, counts, rows };

class LogicCsv final : public ParsedReader {
 public:
  LogicCsv(std::unique_ptr<Source> source, std::string_view name, std::uint64_t samples_per_second)
      : source_(std::move(source)), lines_(*source_), rate_(samples_per_second) {
    layout_.content = Content::changes;
    std::string_view line;
    bool found = false;
    while (!found && lines_.next(line)) {
      if (line.starts_with(';')) {
        comment(line.substr(1));
      } else if (!trim(line).empty()) {
        header(line, name);
        found = true;
      }
    }
    if (!found) throw OpenError(std::string(name) + " has no line that names the columns");
    levels_.emplace(layout_.channels.size());
  }

  [[nodiscard]] bool claim(Block& block) override {
    if (done_ || (!pending_ && !next_row())) {
      finish();
      return false;
    }
    begin_block(block, index_++, at_);
    levels_->begin(block);
    const std::uint64_t begin = lines_.offset();
    const Tick first = at_;
    // Level changes with the same time must be in the same block.
    Tick last = first;
    do {
      if (at_ != last && lines_.offset() - begin >= text_at_once) {
        pending_ = true;
        block.end = at_;
        return true;
      }
      last = at_;
      apply();
      pending_ = false;
    } while (next_row());
    done_ = true;
    block.end = last + 1;
    return true;
  }

 private:
  void comment(std::string_view text) {
    text = trim(text);
    if (text.starts_with("Samplerate:")) {
      if (const auto rate = parse_rate(text.substr(11))) rate_ = *rate;
    } else if (text.starts_with("Channels (")) {
      std::string_view list = text.substr(std::min(text.find(':'), text.size() - 1) + 1);
      while (!list.empty() && names_.size() < most_columns) names_.emplace_back(trim(take_field(list)));
    }
  }

  void header(std::string_view line, std::string_view name) {
    const bool kinds = names_kinds(line);
    if (!kinds && !names_.empty()) {
      throw OpenError(std::string(name) + ": this CSV does not tell its unit of time: write it with label=units");
    }
    if (kinds) {
      kinds_of_columns(line, name);
    } else {
      static_cast<void>(take_field(line));
      while (!line.empty()) add_column(std::string(trim(take_field(line))), name);
      layout_.ticks_per_second = 1'000'000'000'000;
      clock_ = RowTime::seconds;
    }
    if (layout_.channels.empty()) throw OpenError(std::string(name) + " names no channels in its first line");
  }

  void kinds_of_columns(std::string_view line, std::string_view name) {
    clock_ = RowTime::rows;
    layout_.ticks_per_second = rate_;
    const std::string_view first = line.substr(0, line.find(','));
    if (const TimeUnit* unit = find_unit(first)) {
      clock_ = RowTime::counts;
      layout_.ticks_per_second = unit->per_second;
    }
    if (first != "logic") static_cast<void>(take_field(line));
    skip_first_ = first == "samples";
    std::size_t others = 0;
    for (std::size_t column = 0; !line.empty(); ++column) {
      if (take_field(line) == "logic") {
        add_column(column < names_.size() ? names_[column] : std::to_string(column), name);
      } else {
        columns_.push_back(0);
        ++others;
      }
    }
    if (others != 0) {
      damages_.add(
          {.what = std::to_string(others) + " columns are not of logic levels and are left out", .note = true});
    }
  }

  void add_column(std::string channel, std::string_view name) {
    if (layout_.channels.size() == most_columns) {
      throw OpenError(std::string(name) + " has more than " + std::to_string(most_columns) + " channels");
    }
    layout_.channels.push_back(std::move(channel));
    columns_.push_back(1);
  }

  bool fail(std::string what) {
    done_ = true;
    damages_.add({.offset = lines_.offset(), .tick = started_ ? at_ : 0, .what = std::move(what)});
    return false;
  }

  bool next_row() {
    std::string_view row;
    do {
      if (!lines_.next(row)) {
        if (lines_.too_long()) return fail("a line of more than 1 MiB is no row of this CSV");
        done_ = true;
        return false;
      }
    } while (trim(row).empty() || row.starts_with(';'));
    const std::optional<Tick> at = row_time(row);
    if (!at) return fail("this row has no time that goes on from the row before it: is the file cut or mixed up?");
    values_.clear();
    for (const char channel : columns_) {
      const std::string_view field = trim(take_field(row));
      if (channel == 0) continue;
      if (field.size() != 1 || !is_level(field[0])) {
        return fail("this row does not have 0, 1 or X for each channel: is the file cut here?");
      }
      values_.push_back(field[0]);
    }
    if (!row.empty()) return fail("this row has more columns than the first line names");
    at_ = *at;
    return true;
  }

  std::optional<Tick> row_time(std::string_view& row) {
    std::optional<Tick> at;
    const bool first = std::exchange(first_row_, false);
    if (clock_ == RowTime::rows) {
      if (skip_first_) static_cast<void>(take_field(row));
      return rows_++;
    }
    const std::string_view field = trim(take_field(row));
    if (clock_ == RowTime::counts) {
      Tick value = 0;
      const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
      if (error != std::errc() || end != field.data() + field.size()) return std::nullopt;
      if (value == std::numeric_limits<Tick>::max()) return std::nullopt;
      at = value;
    } else {
      std::optional<Instant> instant = parse_seconds(field);
      if (!instant) instant = parse_clock(field);
      if (!instant) return std::nullopt;
      if (first) origin_ = *instant;
      at = ticks_between(origin_, *instant, 1);
    }
    if (at && !first && *at < at_) return std::nullopt;
    return at;
  }

  void apply() {
    for (std::size_t i = 0; i < values_.size(); ++i) {
      if (values_[i] == 'X' || values_[i] == 'x') {
        unknown_.add(lines_.offset(), at_);
      } else if (started_) {
        levels_->set(i, values_[i] == '1', at_);
      } else {
        levels_->start(i, values_[i] == '1');
      }
    }
    started_ = true;
  }

  void finish() {
    if (finished_) return;
    finished_ = true;
    unknown_.report(damages_, "levels are X: taken as the level before");
  }

  std::unique_ptr<Source> source_;
  TextLines lines_;
  std::uint64_t rate_;
  std::vector<std::string> names_;
  // for each column except that of the time: 1 if it has the levels of a channel, 0 if it is left out
  std::vector<char> columns_;
  RowTime clock_ = RowTime::seconds;
  bool skip_first_ = false;
  bool first_row_ = true;
  bool started_ = false;
  bool pending_ = false;  // the row that was read last belongs to the next block and waits for it
  bool done_ = false;
  bool finished_ = false;
  std::uint64_t index_ = 0;
  Tick rows_ = 0;
  Instant origin_;
  Tick at_ = 0;
  std::vector<char> values_;
  std::optional<LevelWriter> levels_;
  Occurrences unknown_;
};

}  // namespace

bool is_logic_csv(std::string_view head) {
  if (head.starts_with("; CSV generated by libsigrok")) return true;
  const std::string_view line = trim(head.substr(0, head.find('\n')));
  return begins_with_time(line) || names_kinds(line);
}

std::unique_ptr<Reader> read_logic_csv(std::unique_ptr<Source> source, std::string_view name,
                                       std::uint64_t samples_per_second) {
  return std::make_unique<LogicCsv>(std::move(source), name, samples_per_second);
}

}  // namespace absenc::capture
