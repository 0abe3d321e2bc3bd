// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "absenc/capture/lines/blocks.hpp"
#include "absenc/capture/lines/edges.hpp"
#include "absenc/capture/lines/pipeline.hpp"

namespace absenc::capture {

namespace {

constexpr std::size_t enough_clocks = 8194;  // number of clock changes that suffice to find the period
// Limit for the number of level changes of data and chip select that are stored while the clock has too few changes.
constexpr std::size_t most_data = 64 * 16384;

// Indices of the wires of a clocked line among the channels that are read.
struct WireIndices {
  explicit WireIndices(const ClockedLine& line) : channels{line.clock} {
    const auto add = [this](const std::optional<unsigned>& channel) -> std::optional<std::size_t> {
      if (!channel) return std::nullopt;
      channels.push_back(*channel);
      return channels.size() - 1;
    };
    in = add(line.in);
    out = add(line.out);
    select = add(line.select);
    direction = add(line.direction);
  }
  [[nodiscard]] ClockedPart part(const Levels& levels) const {
    const auto at = [&](const std::optional<std::size_t>& index) { return index ? &levels.changes[*index] : nullptr; };
    return {&levels.changes[0], at(in), at(out), at(select), at(direction), levels.first, levels.end};
  }

  std::vector<unsigned> channels;
  std::optional<std::size_t> in;
  std::optional<std::size_t> out;
  std::optional<std::size_t> select;
  std::optional<std::size_t> direction;
};

class ClockedDecoding {
 public:
  struct Guess {
    std::optional<ClockedDecoder> decoder;
    std::vector<Burst> bursts;
  };

  ClockedDecoding(const WireIndices& wires, const ClockedFormat& format, const PartSink& sink)
      : wires_(wires), format_(format), sink_(sink), decoder_(format) {}

  bool decode(const Levels& levels) {
    if (levels.first == levels.end) return true;
    begin(levels);
    decoder_.decode(wires_.part(levels), bursts_);
    return deliver();
  }
  void guess(const Levels& levels, Guess& guess) const {
    guess.decoder.emplace(format_);
    guess.bursts.clear();
    guess.decoder->decode(wires_.part(levels), guess.bursts);
  }
  bool join(const Levels& levels, Guess& guess) {
    if (levels.first == levels.end) return true;
    begin(levels);
    decoder_.join(wires_.part(levels), *guess.decoder, guess.bursts, bursts_);
    return deliver();
  }
  void finish() {
    decoder_.finish(bursts_);
    deliver();
  }

  [[nodiscard]] bool clock_seen() const { return clock_seen_; }
  [[nodiscard]] bool selected() const { return selected_; }

 private:
  // Prepares the decoder for the next part of the capture. If there is a gap before it, the burst in progress ends.
  void begin(const Levels& levels) {
    if (begun_ && levels.first != end_) decoder_.finish(bursts_);
    const Changes& clock = levels.changes[0];
    const bool moved = begun_ && levels.first == end_ && clock.before != clock_level_;
    clock_seen_ = clock_seen_ || moved || !clock.at.empty();
    clock_level_ = level_after(clock);
    if (wires_.select) {
      const Changes& select = levels.changes[*wires_.select];
      selected_ = selected_ || select.before == format_.select_high || !select.at.empty();
    }
    begun_ = true;
    end_ = levels.end;
  }
  bool deliver() {
    const bool wanted = sink_({decoder_.settled(end_), {}, bursts_, {}});
    bursts_.clear();
    return wanted;
  }

  const WireIndices& wires_;
  ClockedFormat format_;
  const PartSink& sink_;
  ClockedDecoder decoder_;
  std::vector<Burst> bursts_;
  bool begun_ = false;
  bool clock_seen_ = false;
  bool clock_level_ = false;
  bool selected_ = false;
  Tick end_ = 0;
};

std::string no_clock(const std::string& name) {
  return name + " never changes its level, so there is no clock: is it the right channel, and was it connected?";
}

// Returns the bursts at the beginning of the capture, up to the clock change at `last`.
std::vector<Burst> bursts_until(Tick last, const std::vector<Levels>& parts, const WireIndices& wires,
                                const ClockedFormat& format) {
  std::vector<Burst> bursts;
  ClockedDecoder decoder(format);
  Tick end = 0;
  for (const Levels& levels : parts) {
    if (levels.first > last) break;
    if (end != 0 && levels.first != end) decoder.finish(bursts);
    Levels begin{.first = levels.first, .end = std::min(levels.end, last + 1), .changes = {}};
    for (const Changes& one : levels.changes) {
      Changes clipped{.before = one.before, .at = {}};
      clipped.at.assign(one.at.begin(), std::upper_bound(one.at.begin(), one.at.end(), last));
      begin.changes.push_back(std::move(clipped));
    }
    decoder.decode(wires.part(begin), bursts);
    end = levels.end;
  }
  return bursts;
}

// Returns whether the data line changed in each rest between bursts, more than `settle` after the last clock change.
bool changes_in_rests(const std::vector<Burst>& bursts, const std::vector<Levels>& parts, const WireIndices& wires,
                      Tick settle) {
  if (!wires.in || bursts.size() < 2) return false;
  std::vector<Tick> changes;
  for (const Levels& levels : parts) {
    const Changes& data = levels.changes[*wires.in];
    changes.insert(changes.end(), data.at.begin(), data.at.end());
  }
  for (std::size_t i = 1; i < bursts.size(); ++i) {
    const auto change = std::upper_bound(changes.begin(), changes.end(), bursts[i - 1].end + settle);
    if (change == changes.end() || *change >= bursts[i].begin) return false;
  }
  return true;
}

// Measures the clock and sets the limits of rests in `format`; returns the problem, or "".
std::string find_pause(LevelReader& reader, const WireIndices& wires, const ClockedLine& line,
                       std::vector<Levels>& parts, ClockedFormat& format) {
  Changes clock;
  bool begun = false;
  std::size_t others = 0;
  look_ahead(reader, parts, [&](const Levels& levels) {
    if (levels.first == levels.end) return false;
    if (!std::exchange(begun, true)) clock.before = levels.changes[0].before;
    append(clock, levels.changes[0], levels.first);
    for (std::size_t i = 1; i < levels.changes.size(); ++i) others += levels.changes[i].at.size();
    return clock.at.size() > enough_clocks || others > most_data;
  });
  const std::optional<ClockRests> rests = find_rests(clock);
  if (!rests) {
    const std::string name = reader.name(line.clock);
    if (clock.at.empty() && others <= most_data) return no_clock(name);
    return name + " changes its level only " + std::to_string(clock.at.size()) + " times, its data " +
           std::to_string(others) + " times, so there is no word: is it the right channel?";
  }
  format.settle = rests->half_period;
  // A line with a delay of at least half a clock period delays each bit by one clock, with one and a half periods by
  // two.
  format.tail = static_cast<std::uint8_t>(std::min<Tick>(32, (line.delay / rests->half_period + 1) / 2));
  format.pause = rests->pauses.front();
  if (!line.choose) return {};
  const Tick last = clock.at[std::min(clock.at.size(), enough_clocks) - 1];
  std::vector<ClockedFormat> word_formats;
  for (const Tick pause : rests->pauses) {
    word_formats.push_back(format);
    word_formats.back().pause = pause;
  }
  // A change of the data line in a rest marks the end of a word: the encoder's timeout (monoflop) ends only between
  // words.
  if (wires.in) {
    word_formats.push_back(word_formats.back());
    // If no encoder drives the data line, it never changes: then only long rests end words.
    word_formats.back().pause =
        std::max(rests->longest / 2, *std::max_element(rests->pauses.begin(), rests->pauses.end()));
    word_formats.back().change_pause = 2 * rests->half_period;
  }
  std::vector<PauseReading> readings;
  for (const ClockedFormat& word_format : word_formats) {
    readings.push_back(
        {word_format.pause, word_format.change_pause != 0, bursts_until(last, parts, wires, word_format)});
    readings.back().timed_out = changes_in_rests(readings.back().bursts, parts, wires, format.settle);
  }
  format = word_formats[line.choose(readings)];
  return {};
}

}  // namespace

ClockedOutcome decode_clocked(Reader& source, const ClockedLine& line, unsigned threads, const PartSink& sink) {
  const WireIndices wires(line);
  LevelReader reader(source, wires.channels);
  ClockedOutcome outcome{reader.problem(), line.pause};
  if (outcome.problem.empty() && !line.in && !line.out) {
    outcome.problem = "no channel with data was named: name at least one";
  }
  if (!outcome.problem.empty()) return outcome;

  std::vector<Levels> parts;
  ClockedFormat format{
      line.rising, line.select.has_value(), line.select_high, line.pause, line.settle, line.change_pause,
      0,           line.low_goes_on};
  if (!line.select && line.pause == 0) {
    outcome.problem = find_pause(reader, wires, line, parts, format);
    if (!outcome.problem.empty()) return outcome;
  }
  outcome.pause = format.pause;
  ClockedDecoding decoding(wires, format, sink);
  bool wanted = true;
  for (const Levels& levels : std::exchange(parts, {})) wanted = wanted && decoding.decode(levels);
  if (wanted) wanted = BlockRun<ClockedDecoding>(reader, decoding, threads).run();
  if (!wanted) return outcome;
  decoding.finish();
  if (!decoding.clock_seen())
    outcome.problem = no_clock(reader.name(line.clock));
  else if (line.select && !decoding.selected()) {
    outcome.problem = reader.name(*line.select) +
                      " is never active: is it the right channel and polarity? Without chip "
                      "select, words end where the clock pauses";
  }
  return outcome;
}

}  // namespace absenc::capture
