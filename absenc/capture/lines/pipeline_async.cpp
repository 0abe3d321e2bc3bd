// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <utility>

#include "absenc/capture/lines/blocks.hpp"
#include "absenc/capture/lines/edges.hpp"
#include "absenc/capture/lines/pipeline.hpp"

namespace absenc::capture {

namespace {

constexpr std::size_t enough_changes = 16384;  // number of changes of a line that suffice to detect its settings
// Limit for the number of changes of one line that are stored while another line has too few changes to detect its
// settings.
constexpr std::size_t most_changes = 64 * 16384;
constexpr double fewest_ticks = 2.5;  // shortest bit time, in ticks

class AsyncDecoding {
 public:
  struct Guess {
    std::vector<AsyncDecoder> decoders;
    std::vector<std::vector<Character>> characters;
  };

  AsyncDecoding(std::span<const AsyncFormat> formats, const PartSink& sink)
      : formats_(formats), sink_(sink), characters_(formats.size()) {
    for (const AsyncFormat& format : formats) {
      decoders_.emplace_back(format, static_cast<std::uint8_t>(decoders_.size()));
    }
  }

  bool decode(const Levels& levels) {
    if (levels.first == levels.end) return true;
    begin(levels);
    for (std::size_t i = 0; i < decoders_.size(); ++i) {
      decoders_[i].decode(levels.changes[i], levels.first, levels.end, characters_[i]);
    }
    return deliver(settled());
  }

  void guess(const Levels& levels, Guess& guess) const {
    while (guess.decoders.size() < formats_.size()) {
      const std::size_t i = guess.decoders.size();
      guess.decoders.emplace_back(formats_[i], static_cast<std::uint8_t>(i));
      guess.characters.emplace_back();
    }
    for (std::size_t i = 0; i < formats_.size(); ++i) {
      guess.characters[i].clear();
      guess.decoders[i].restart(AsyncDecoder::Start::trust);
      guess.decoders[i].decode(levels.changes[i], levels.first, levels.end, guess.characters[i]);
    }
  }

  bool join(const Levels& levels, Guess& guess) {
    if (levels.first == levels.end) return true;
    begin(levels);
    for (std::size_t i = 0; i < decoders_.size(); ++i) {
      decoders_[i].join(levels.changes[i], levels.first, levels.end, guess.decoders[i], guess.characters[i],
                        characters_[i]);
    }
    return deliver(settled());
  }

  void finish() {
    finish_lines();
    deliver(std::numeric_limits<Tick>::max());
  }

  [[nodiscard]] AsyncDecoder::Statistics statistics(std::size_t line) const { return decoders_[line].statistics(); }

 private:
  // Prepares the decoders for the next part of the capture. If there is a gap before it, the characters in progress
  // end.
  void begin(const Levels& levels) {
    if (begun_ && levels.first != end_) finish_lines();
    begun_ = true;
    end_ = levels.end;
  }
  void finish_lines() {
    for (std::size_t i = 0; i < decoders_.size(); ++i) decoders_[i].finish(characters_[i]);
  }
  [[nodiscard]] Tick settled() const {
    Tick least = end_;
    for (const AsyncDecoder& decoder : decoders_) least = std::min(least, decoder.settled());
    return least;
  }

  // Replaces each character by two with a byte each, which share its time, the low byte first.
  static void split(std::vector<Character>& characters) {
    std::vector<Character> bytes;
    bytes.reserve(2 * characters.size());
    for (const Character& character : characters) {
      Character byte = character;
      byte.end = character.begin + (character.end - character.begin) / 2;
      byte.high = 0;
      bytes.push_back(byte);
      byte.begin = std::exchange(byte.end, character.end);
      byte.value = character.high;
      bytes.push_back(byte);
    }
    characters.swap(bytes);
  }

  // Delivers the characters that begin before `until` and before the end of the last decoded part of the capture.
  // Returns false if the sink ends the decoding.
  bool deliver(Tick until) {
    const Tick end = std::min(until, end_);
    if (characters_.size() == 1) {
      if (formats_[0].data_bits > 8) split(characters_[0]);
      const bool wanted = sink_({end, characters_[0], {}, formats_});
      characters_[0].clear();
      return wanted;
    }
    ready_.clear();
    for (std::vector<Character>& line : characters_) {
      const auto after =
          std::partition_point(line.begin(), line.end(), [&](const Character& c) { return c.begin < until; });
      ready_.insert(ready_.end(), line.begin(), after);
      line.erase(line.begin(), after);
    }
    std::stable_sort(ready_.begin(), ready_.end(),
                     [](const Character& a, const Character& b) { return a.begin < b.begin; });
    if (formats_[0].data_bits > 8) split(ready_);
    return sink_({end, ready_, {}, formats_});
  }

  std::span<const AsyncFormat> formats_;
  const PartSink& sink_;
  std::vector<AsyncDecoder> decoders_;
  std::vector<std::vector<Character>> characters_;
  std::vector<Character> ready_;
  bool begun_ = false;
  Tick end_ = 0;
};

bool unknown(const AsyncSettings& settings) { return settings.baud == 0 || settings.idle == Idle::automatic; }

// The first changes of all lines, and the parts of the capture that were read for them.
class FirstChanges {
 public:
  FirstChanges(LevelReader& reader, std::span<const AsyncLine> lines) : lines_(lines), changes_(lines.size()) {
    const bool needed = std::any_of(lines.begin(), lines.end(), [](const AsyncLine& l) { return unknown(l.settings); });
    if (!needed) return;
    look_ahead(reader, parts, [this](const Levels& levels) { return take(levels); });
    cut();
  }

  [[nodiscard]] std::size_t count(std::size_t line) const { return changes_[line].at.size(); }
  [[nodiscard]] std::optional<AsyncFormat> format(std::size_t line, const AsyncSettings& settings,
                                                  std::uint64_t ticks_per_second) const {
    return find_format(changes_[line], first_, ends_[line], settings, ticks_per_second);
  }

  std::vector<Levels> parts;

 private:
  bool take(const Levels& levels) {
    if (levels.first == levels.end) return false;
    bool all = true;
    bool any = false;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (!begun_) changes_[i].before = levels.changes[i].before;
      append(changes_[i], levels.changes[i], levels.first);
      all = all && (count(i) > enough_changes || !unknown(lines_[i].settings));
      any = any || count(i) > most_changes;
    }
    if (!begun_) first_ = levels.first;
    begun_ = true;
    end_ = levels.end;
    return all || any;
  }

  // Drops all level changes after a fixed number of them, so that the detected settings do not depend on the sizes of
  // the parts.
  void cut() {
    for (const Changes& line : changes_) {
      if (line.at.size() > most_changes) end_ = std::min(end_, line.at[most_changes]);
    }
    for (Changes& line : changes_) {
      Tick end = end_;
      if (line.at.size() > enough_changes) {
        end = std::min(end, line.at[enough_changes]);
      }
      line.at.erase(std::lower_bound(line.at.begin(), line.at.end(), end), line.at.end());
      ends_.push_back(end);
    }
  }

  std::span<const AsyncLine> lines_;
  std::vector<Changes> changes_;
  std::vector<Tick> ends_;
  bool begun_ = false;
  Tick first_ = 0;
  Tick end_ = 0;
};

std::string settings_problem(const LevelReader& reader, std::span<const AsyncLine> lines) {
  for (const AsyncLine& line : lines) {
    if (line.settings.baud == 0) continue;
    if (reader.layout().ticks_per_second == 0) {
      return "the file does not tell how long a sample lasts, so a baud rate says nothing: give the sample rate, or "
             "let "
             "the baud rate be found";
    }
    const double bit = static_cast<double>(reader.layout().ticks_per_second) / line.settings.baud;
    if (bit < fewest_ticks) {
      return "a bit of " + reader.name(line.channel) + " would last " + std::to_string(bit) +
             " samples, and 2.5 are the least: is the baud rate right? Else sample faster";
    }
  }
  return {};
}

// Finds the formats of all lines. Returns the problem as a sentence, or "" without a problem.
std::string find_formats(const LevelReader& reader, std::span<const AsyncLine> lines, const FirstChanges& first,
                         std::vector<AsyncFormat>& formats) {
  const std::uint64_t ticks_per_second = reader.layout().ticks_per_second;
  std::optional<double> bit;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const AsyncSettings& settings = lines[i].settings;
    AsyncFormat format{
        0, settings.idle != Idle::low, settings.parity, settings.stop_bits, settings.glitch, settings.data_bits};
    if (!unknown(settings)) {
      format.bit = static_cast<double>(ticks_per_second) / settings.baud;
    } else if (const auto found = first.format(i, settings, ticks_per_second)) {
      format = *found;
    }
    if (!bit && format.bit != 0) bit = format.bit;
    formats.push_back(format);
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (formats[i].bit != 0) continue;
    if (bit) {
      AsyncSettings known = lines[i].settings;
      known.baud = 1 / *bit;
      formats[i] = *first.format(i, known, 1);
    } else if (first.count(i) == 0) {
      return reader.name(lines[i].channel) + " never changes its level: is it the right channel, and was it connected?";
    } else {
      return "no baud rate explains " + reader.name(lines[i].channel) + ", which changes its level " +
             (first.count(i) < enough_changes ? std::to_string(first.count(i)) + " times" : std::string("often")) +
             ": give the baud rate, and the parity if there is one, or sample faster";
    }
  }
  return {};
}

}  // namespace

AsyncOutcome decode_async(Reader& source, std::span<const AsyncLine> lines, unsigned threads, const PartSink& sink) {
  std::vector<unsigned> channels;
  for (const AsyncLine& line : lines) channels.push_back(line.channel);
  LevelReader reader(source, channels);
  AsyncOutcome outcome;
  outcome.problem = reader.problem();
  if (outcome.problem.empty()) outcome.problem = settings_problem(reader, lines);
  if (!outcome.problem.empty()) return outcome;

  FirstChanges first(reader, lines);
  outcome.problem = find_formats(reader, lines, first, outcome.formats);
  if (!outcome.problem.empty()) return outcome;

  AsyncDecoding decoding(outcome.formats, sink);
  bool wanted = true;
  for (const Levels& levels : std::exchange(first.parts, {})) wanted = wanted && decoding.decode(levels);
  if (wanted) wanted = BlockRun<AsyncDecoding>(reader, decoding, threads).run();
  if (wanted) decoding.finish();
  const auto ticks_per_second = static_cast<double>(reader.layout().ticks_per_second);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const AsyncDecoder::Statistics sum = decoding.statistics(i);
    outcome.statistics.push_back(sum);
    outcome.measured_baud.push_back(
        sum.ticks == 0 ? 0 : ticks_per_second * static_cast<double>(sum.bits) / static_cast<double>(sum.ticks));
  }
  return outcome;
}

}  // namespace absenc::capture
