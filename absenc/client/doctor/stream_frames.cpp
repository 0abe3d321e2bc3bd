// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/doctor/stream_frames.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace absenc::client {

namespace {

using namespace std::chrono_literals;
using ByteList = std::vector<std::uint8_t>;

// least number of pieces of the stream between pauses, of times between frames, or of doubled frames from which a
// conclusion is drawn
constexpr std::size_t enough = 8;

/// Bytes without a pause between them, and the time at which the first of them arrived.
struct PausedBytes {
  Time at{};
  ByteList bytes{};
};

// Divides the stream where no byte arrived for at least `pause`, and returns the pieces. Leaves out the first and the
// last piece, which may be cut.
std::vector<PausedBytes> pieces_of(const StreamBytes& stream, Time pause) {
  std::vector<PausedBytes> pieces;
  std::size_t begin = 0;
  Time before{};
  for (const StreamBytes::Mark& mark : stream.marks) {
    if (pieces.empty() || mark.at - before >= pause) pieces.push_back({.at = mark.at});
    ByteList& bytes = pieces.back().bytes;
    bytes.insert(bytes.end(), stream.bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                 stream.bytes.begin() + static_cast<std::ptrdiff_t>(mark.bytes));
    begin = mark.bytes;
    before = mark.at;
  }
  if (pieces.size() < 2) return {};
  pieces.pop_back();
  pieces.erase(pieces.begin());
  return pieces;
}

double evenness(const std::vector<PausedBytes>& pieces) {
  if (pieces.size() < enough) return 0;
  std::map<std::size_t, std::size_t> lengths;
  for (const PausedBytes& piece : pieces) ++lengths[piece.bytes.size()];
  const auto usual = std::ranges::max_element(lengths, {}, [](const auto& one) { return one.second; });
  if (usual->first < 2) return 0;
  return static_cast<double>(usual->second) / static_cast<double>(pieces.size());
}

// Divides a stream into pieces at its pauses, with the pause length that gives the greatest share of pieces of equal
// size. If several lengths do about equally well, takes the middle one, which is the safest.
std::vector<PausedBytes> most_even_pieces(const StreamBytes& stream) {
  constexpr Time shortest = 100us;
  constexpr Time longest = 200ms;
  constexpr double least = 0.5;
  constexpr double tolerance = 0.02;
  std::vector<std::pair<Time, double>> tried;
  double best = 0;
  for (Time pause = shortest; pause <= longest; pause = pause * 3 / 2) {
    tried.emplace_back(pause, evenness(pieces_of(stream, pause)));
    best = std::max(best, tried.back().second);
  }
  if (best < least) return {};
  std::erase_if(tried, [best](const auto& one) { return one.second < best - tolerance; });
  return pieces_of(stream, tried[tried.size() / 2].first);
}

std::vector<Time> distances_of(const std::vector<Time>& arrivals) {
  std::vector<Time> distances;
  for (std::size_t i = 1; i < arrivals.size(); ++i) distances.push_back(arrivals[i] - arrivals[i - 1]);
  return distances;
}

// Returns the usual time between two frames of a stream; 0 if there are too few frames, or the times are irregular.
Time period_of(std::vector<Time> distances) {
  if (distances.size() < enough) return {};
  std::ranges::sort(distances);
  const Time period = distances[distances.size() / 2];
  const auto even = std::ranges::count_if(
      distances, [period](Time distance) { return distance * 3 > period * 2 && distance * 3 < period * 4; });
  return static_cast<std::size_t>(even) * 10 >= distances.size() * 6 ? period : Time{};
}

}  // namespace

void StreamBytes::append(const LineExchange<std::uint8_t>& line) {
  const Time arrived = line.marks.empty() ? Time{} : line.marks.back().at;
  arrivals.push_back(arrivals.empty() ? arrived : std::max(arrived, arrivals.back()));
  constexpr std::size_t most = std::size_t{1} << 20;
  if (bytes.size() + line.received.size() > most) return;
  const std::size_t before = bytes.size();
  bytes.insert(bytes.end(), line.received.begin(), line.received.end());
  for (const auto& mark : line.marks) marks.push_back({mark.at, before + mark.items});
}

std::vector<Attempted> frames_between_pauses(const Unit& unit, const Options& options, const StreamBytes& stream) {
  std::vector<Attempted> frames;
  for (PausedBytes& piece : most_even_pieces(stream)) {
    Attempted one{.error = unit.check(options, {}, {.bytes = piece.bytes}), .began = piece.at};
    one.heard = one.answered = true;
    one.exchange.reply.bytes = piece.bytes;
    one.raw = std::move(piece.bytes);
    frames.push_back(std::move(one));
  }
  return frames;
}

void insert_missing_frames(std::vector<Attempted>& readings, const std::vector<Time>& arrivals) {
  const std::vector<Time> distances = distances_of(arrivals);
  const Time period = period_of(distances);
  if (period == Time{}) return;
  // missing[i] is the number of frames that did not arrive between the readings i - 1 and i.
  std::vector<std::size_t> missing(readings.size(), 0);
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const double periods = static_cast<double>(distances[i - 1].count()) / static_cast<double>(period.count());
    const auto due = static_cast<std::size_t>(std::lround(periods));
    const std::size_t come = 1 + static_cast<std::size_t>(readings[i].discarded);
    // Counts no missing frames where some were discarded as damaged: two damaged frames may have been discarded as one.
    if (due > come && readings[i].discarded == 0) missing[i] = due - come;
    // A late frame may have been counted as missing; the frames after it then seem early.
    std::size_t early = come > due ? come - due : 0;
    for (std::size_t back = i; early > 0 && back > 0; --back) {
      const std::size_t late = std::min(missing[back - 1], early);
      missing[back - 1] -= late;
      early -= late;
    }
  }
  // A gap just before the end of the stream counts as no missing frame, because a late frame may still follow.
  for (std::size_t i = readings.size() - std::min<std::size_t>(readings.size(), 2); i < readings.size(); ++i)
    missing[i] = 0;
  // A single missing frame is ignored, because the delay of the arrivals may have changed.
  if (std::accumulate(missing.begin(), missing.end(), std::size_t{0}) < 2) return;
  std::vector<Attempted> all;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    for (std::size_t n = 1; n <= missing[i]; ++n) {
      all.push_back(
          {.error = Error::timeout, .began = arrivals[i - 1] + static_cast<std::int64_t>(n) * period, .limit = period});
    }
    all.push_back(std::move(readings[i]));
  }
  readings = std::move(all);
}

std::size_t count_doubled(const std::vector<Attempted>& readings, const std::vector<Time>& arrivals) {
  std::size_t doubled = 0;
  std::size_t changed = 0;
  for (std::size_t i = 1; i + 1 < readings.size(); ++i) {
    const bool is_equal = readings[i].raw == readings[i - 1].raw;
    const bool is_directly_after = (arrivals[i] - arrivals[i - 1]) * 4 < arrivals[i + 1] - arrivals[i - 1];
    doubled += is_equal && is_directly_after && readings[i].error == Error::none ? 1 : 0;
    changed += is_equal ? 0 : 1;
  }
  const bool are_most = doubled >= enough && doubled * 10 >= readings.size() * 4;
  return are_most && changed * 10 >= readings.size() * 2 ? doubled : 0;
}

void conclude_stream(const Unit& unit, const Options& options, const StreamBytes& stream, Observations& seen) {
  seen.is_stream = true;
  std::vector<Attempted> frames = frames_between_pauses(unit, options, stream);
  if (!hardly_any_good(seen.readings)) {
    std::erase_if(frames, [](const Attempted& one) { return one.error == Error::none; });
    seen.damaged_frames = std::move(frames);
    seen.doubled = count_doubled(seen.readings, stream.arrivals);
    insert_missing_frames(seen.readings, stream.arrivals);
  } else if (!frames.empty()) {
    // Hardly any reading is good, so the frames of the stream take the place of the readings.
    seen.readings = std::move(frames);
  } else if (!stream.bytes.empty()) {
    constexpr std::size_t most_shown = 256;
    Attempted& last = seen.readings.back();
    last.heard = last.answered = true;
    last.raw = stream.bytes;
    last.raw.resize(std::min(last.raw.size(), most_shown));
    last.exchange.reply.bytes = last.raw;
  }
}

}  // namespace absenc::client
