// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/lines/async_format.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace absenc::capture {

namespace {

constexpr double shortest_bit = 2.5;       // shortest bit time, in ticks
constexpr std::size_t fewest_changes = 4;  // number of level changes below which no bit time can be found
constexpr std::size_t tried_changes = 4096;
constexpr std::size_t most_clusters = 8;
constexpr int most_bits = 4;   // each group of pulses of similar length is tried as pulses of 1 to 4 bits
constexpr double worst = 0.5;  // a format (bit time and idle level) with more errors per character than this is refused
// two formats count as equally good if their errors per character differ by less than this
constexpr double alike = 0.01;

// Returns the lengths of the pulses between changes, without glitches, the shortest first.
std::vector<Tick> pulses(const Changes& changes, Tick glitch) {
  std::vector<Tick> lengths;
  for (std::size_t i = 1; i < changes.at.size(); ++i) {
    const Tick length = changes.at[i] - changes.at[i - 1];
    if (length >= glitch) lengths.push_back(length);
  }
  std::sort(lengths.begin(), lengths.end());
  return lengths;
}

// Returns the mean bit time of all pulses of up to `most` bits whose lengths nearly fit the bit time `bit`; without
// such pulses, `bit`.
double fitted(const std::vector<Tick>& lengths, double bit, double most) {
  double ticks = 0;
  double bits = 0;
  for (const Tick length : lengths) {
    const auto value = static_cast<double>(length);
    const double multiple = std::round(value / bit);
    if (multiple > most) break;
    if (multiple < 1 || std::abs(value - multiple * bit) > 0.3 * bit) continue;
    ticks += value;
    bits += multiple;
  }
  return bits == 0 ? bit : ticks / bits;
}

// Sorts pulses into groups of similar length and returns the mean length of each group, the shortest first; leaves out
// rare lengths.
std::vector<double> clusters(const std::vector<Tick>& lengths) {
  const std::size_t rare = lengths.size() < 50 ? 1 : std::max<std::size_t>(2, lengths.size() / 200);
  std::vector<double> means;
  for (std::size_t i = 0; i < lengths.size() && means.size() < most_clusters;) {
    const double limit = static_cast<double>(lengths[i]) * 1.3 + 1;
    double sum = 0;
    std::size_t count = 0;
    for (; i < lengths.size() && static_cast<double>(lengths[i]) <= limit; ++i, ++count) {
      sum += static_cast<double>(lengths[i]);
    }
    if (count >= rare) means.push_back(sum / static_cast<double>(count));
  }
  return means;
}

std::vector<double> possible_bits(const std::vector<Tick>& lengths) {
  std::vector<double> bits;
  for (const double cluster : clusters(lengths)) {
    for (int parts = 1; parts <= most_bits; ++parts) {
      const double bit = fitted(lengths, fitted(lengths, cluster / parts, 3), 10);
      const bool known =
          std::any_of(bits.begin(), bits.end(), [&](double other) { return std::abs(other - bit) < 0.02 * bit; });
      if (bit >= shortest_bit && !known) bits.push_back(bit);
    }
  }
  std::sort(bits.begin(), bits.end(), std::greater<>());
  return bits;
}

struct Stretch {
  const Changes& changes;
  Tick first;
  Tick end;
};

AsyncDecoder::Statistics decoded(const Stretch& part, const AsyncFormat& format) {
  AsyncDecoder decoder(format);
  std::vector<Character> characters;
  decoder.decode(part.changes, part.first, part.end, characters);
  decoder.finish(characters);
  return decoder.statistics();
}

// Returns the faults per character. Pulses that are clearly shorter than a bit count as faults, because they show that
// the assumed bit time is too long.
double faults(const AsyncDecoder::Statistics& statistics, const std::vector<Tick>& lengths, double bit) {
  if (statistics.characters == 0) return 1;
  const auto shorter = std::find_if(lengths.begin(), lengths.end(),
                                    [&](Tick length) { return static_cast<double>(length) >= 0.6 * bit; });
  return static_cast<double>(statistics.faults + static_cast<std::uint64_t>(shorter - lengths.begin())) /
         static_cast<double>(statistics.characters);
}

// Returns the level that lasted longest without a change, which is probably the idle level of a pause.
bool longest_level(const Stretch& part) {
  Tick longest = 0;
  Tick since = part.first;
  bool level = part.changes.before;
  bool found = level;
  const auto update = [&](Tick until) {
    if (until - since > longest) {
      longest = until - since;
      found = level;
    }
    since = until;
    level = !level;
  };
  for (const Tick at : part.changes.at) update(at);
  update(part.end);
  return found;
}

std::vector<bool> possible_idle(const Stretch& part, Idle idle) {
  if (idle != Idle::automatic) return {idle == Idle::high};
  const bool longest = longest_level(part);
  return {longest, !longest};
}

}  // namespace

std::optional<AsyncFormat> find_format(const Changes& changes, Tick first, Tick end, const AsyncSettings& settings,
                                       std::uint64_t ticks_per_second) {
  const Stretch whole{changes, first, end};
  const bool search = settings.baud == 0;
  if (search && changes.at.size() < fewest_changes) return std::nullopt;
  Changes begin{changes.before, {}};
  const std::size_t tried = std::min(tried_changes, changes.at.size());
  begin.at.assign(changes.at.begin(), changes.at.begin() + static_cast<std::ptrdiff_t>(tried));
  const Stretch part{begin, first, tried < changes.at.size() ? changes.at[tried] : end};

  const std::vector<Tick> lengths = pulses(begin, settings.glitch);
  std::vector<double> bits{search ? 0.0 : static_cast<double>(ticks_per_second) / settings.baud};
  if (search) bits = possible_bits(lengths);
  std::optional<AsyncFormat> best;
  double fewest = 0;
  for (const double bit : bits) {
    for (const bool idle_high : possible_idle(part, settings.idle)) {
      const AsyncFormat format{
          bit, idle_high, settings.parity, settings.stop_bits, settings.glitch, settings.data_bits};
      const double found = faults(decoded(part, format), lengths, bit);
      if (best && found >= fewest - alike) continue;
      best = format;
      fewest = found;
    }
  }
  if (!best || !search) return best;
  if (fewest > worst) return std::nullopt;
  for (int round = 0; round < 2; ++round) {
    const AsyncDecoder::Statistics measured = decoded(whole, *best);
    if (measured.bits > 0) best->bit = static_cast<double>(measured.ticks) / static_cast<double>(measured.bits);
  }
  return best;
}

}  // namespace absenc::capture
