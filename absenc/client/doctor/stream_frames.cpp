// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/doctor/stream_frames.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <utility>

#include "absenc/sim/random.hpp"

namespace absenc::client {

namespace {

using namespace std::chrono_literals;
using ByteList = std::vector<std::uint8_t>;

constexpr std::size_t enough = 8;  // least number of frames

/// A piece of the stream: bytes without a pause between them.
struct StreamPiece {
  Time at{};  // arrival time of the first byte
  ByteList bytes{};
};

// Leaves out the first and the last piece, which may be parts of frames because the port was opened and closed.
std::vector<StreamPiece> pieces_of(const StreamBytes& stream, Time pause) {
  std::vector<StreamPiece> pieces;
  std::size_t begin = 0;
  Time before{};
  for (const StreamBytes::Arrival& mark : stream.marks) {
    if (pieces.empty() || mark.at - before >= pause) pieces.push_back({.at = mark.at});
    ByteList& bytes = pieces.back().bytes;
    bytes.insert(bytes.end(), stream.bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                 stream.bytes.begin() + static_cast<std::ptrdiff_t>(mark.end));
    begin = mark.end;
    before = mark.at;
  }
  if (pieces.size() < 2) return {};
  pieces.pop_back();
  pieces.erase(pieces.begin());
  return pieces;
}

// Returns the most frequent size of pieces, and the number of pieces with it.
std::pair<std::size_t, std::size_t> usual_size(const std::vector<StreamPiece>& pieces) {
  std::map<std::size_t, std::size_t> sizes;
  for (const StreamPiece& piece : pieces) ++sizes[piece.bytes.size()];
  return *std::ranges::max_element(sizes, {}, [](const auto& one) { return one.second; });
}

// Returns the fraction of pieces with the most frequent size; 0 if such pieces are not frames.
double evenness(const std::vector<StreamPiece>& pieces) {
  constexpr std::size_t shortest = 2;
  if (pieces.size() < enough) return 0;
  const auto [size, count] = usual_size(pieces);
  return size < shortest ? 0 : static_cast<double>(count) / static_cast<double>(pieces.size());
}

// The pause that ends a frame is unknown. Tries each length and takes the middle of those that give the most equal
// pieces, far from the pauses within a frame and from those between frames.
std::vector<StreamPiece> most_even_pieces(const StreamBytes& stream) {
  constexpr Time shortest = 100us;
  constexpr Time longest = 200ms;
  constexpr double least = 0.5;
  constexpr double alike = 0.02;
  std::vector<std::pair<Time, double>> tried;
  double best = 0;
  for (Time pause = shortest; pause <= longest; pause = pause * 3 / 2) {
    tried.emplace_back(pause, evenness(pieces_of(stream, pause)));
    best = std::max(best, tried.back().second);
  }
  if (best < least) return {};
  std::erase_if(tried, [best](const auto& one) { return one.second < best - alike; });
  return pieces_of(stream, tried[tried.size() / 2].first);
}

// Returns the length of the good frame at the beginning; 0 if there is none.
std::size_t good_frame(const Unit& unit, const Options& options, Bytes bytes) {
  const FrameEnd end = unit.frame_end(options, Direction::reply, bytes);
  if (end.kind != FrameEnd::Kind::complete || end.size == 0 || end.size > bytes.size()) return 0;
  return unit.check(options, {}, {.bytes = bytes.first(end.size)}) == Error::none ? end.size : 0;
}

// Returns the ends of the good frames that make up the bytes; empty if other bytes are among them.
std::vector<std::size_t> good_frames(const Unit& unit, const Options& options, Bytes bytes) {
  std::vector<std::size_t> ends;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = good_frame(unit, options, bytes.subspan(at));
    if (size == 0) return {};
    ends.push_back(at += size);
  }
  return ends;
}

bool is_twice_the_same(const ByteList& bytes) {
  const std::size_t half = bytes.size() / 2;
  return bytes.size() % 2 == 0 && std::equal(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(half),
                                             bytes.begin() + static_cast<std::ptrdiff_t>(half));
}

// Returns whether each frame arrived twice while the shaft moved. An adapter with latency also makes pieces of two
// frames, but those differ.
bool are_doubled(const std::vector<StreamPiece>& pieces) {
  std::size_t doubled = 0;
  std::size_t moved = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    doubled += is_twice_the_same(pieces[i].bytes) ? 1 : 0;
    moved += i > 0 && pieces[i].bytes != pieces[i - 1].bytes ? 1 : 0;
  }
  return doubled * 10 >= pieces.size() * 8 && moved * 2 >= pieces.size();
}

/// A group of frames that arrived together.
struct Group {
  Time at{};
  std::vector<ByteList> frames{};
  std::size_t missing = 0;  // number of missing frames before the group
};

// Returns the ends of the frames in a piece longer than most: frames that arrived together, some of them damaged.
std::vector<std::size_t> joined_frames(const Unit& unit, const Options& options, Bytes bytes, std::size_t usual) {
  std::vector<std::size_t> ends;
  std::size_t at = 0;
  const bool is_even = bytes.size() % usual == 0;
  while ((bytes.size() - at) * 2 > usual * 3) {
    const std::size_t size = is_even ? 0 : good_frame(unit, options, bytes.subspan(at));
    ends.push_back(at += size != 0 ? size : usual);
  }
  ends.push_back(bytes.size());
  return ends;
}

std::vector<Group> groups_of(const Unit& unit, const Options& options, const std::vector<StreamPiece>& pieces) {
  if (pieces.empty()) return {};
  const bool doubled = are_doubled(pieces);
  const std::size_t usual = usual_size(pieces).first;
  std::vector<Group> groups;
  for (const StreamPiece& piece : pieces) {
    Group group{.at = piece.at};
    std::vector<std::size_t> ends;
    if (!doubled) ends = good_frames(unit, options, piece.bytes);
    if (ends.empty()) ends = joined_frames(unit, options, piece.bytes, usual);
    std::size_t begin = 0;
    for (const std::size_t end : ends) {
      group.frames.emplace_back(piece.bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                                piece.bytes.begin() + static_cast<std::ptrdiff_t>(end));
      begin = end;
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

// Returns the period of frames; 0 if they are not periodic.
Time period_of(const std::vector<Group>& groups) {
  std::vector<Time> distances;
  for (std::size_t i = 1; i < groups.size(); ++i) {
    distances.push_back((groups[i].at - groups[i - 1].at) / static_cast<std::int64_t>(groups[i].frames.size()));
  }
  std::ranges::sort(distances);
  const Time period = distances[distances.size() / 2];
  const auto even = std::ranges::count_if(
      distances, [period](Time distance) { return distance * 3 > period * 2 && distance * 3 < period * 4; });
  return static_cast<std::size_t>(even) * 10 >= distances.size() * 7 ? period : Time{};
}

// A late frame counts as missing until it arrives; the frames after it then arrive too early.
void count_missing(std::vector<Group>& groups, Time period) {
  constexpr std::size_t most_late = 16;  // limit in groups
  for (std::size_t i = 1; i < groups.size(); ++i) {
    const double periods =
        static_cast<double>((groups[i].at - groups[i - 1].at).count()) / static_cast<double>(period.count());
    const auto due = static_cast<std::size_t>(std::lround(periods));
    std::size_t come = groups[i].frames.size();
    if (due > come) groups[i].missing = due - come;
    for (std::size_t back = 1; come > due && back <= std::min(i, most_late); ++back) {
      const std::size_t late = std::min(groups[i - back].missing, come - due);
      groups[i - back].missing -= late;
      come -= late;
    }
  }
}

Attempted missing_frame(Time at, Time period) { return {.error = Error::timeout, .began = at, .limit = period}; }

Attempted frame_of(const Unit& unit, const Options& options, const ByteList& bytes, Time at, Time period) {
  Attempted one{.error = unit.check(options, {}, {.bytes = bytes}), .began = at, .limit = period};
  one.exchange.reply.bytes = one.raw = bytes;
  one.heard = one.answered = true;
  return one;
}

}  // namespace

std::vector<Attempted> stream_frames(const Unit& unit, const Options& options, const StreamBytes& stream) {
  std::vector<Group> groups = groups_of(unit, options, most_even_pieces(stream));
  if (groups.size() < enough) return {};
  const Time period = period_of(groups);
  if (period > Time{}) count_missing(groups, period);
  std::vector<Attempted> frames;
  Time before{};
  for (const Group& group : groups) {
    for (std::size_t i = 1; i <= group.missing; ++i) {
      frames.push_back(missing_frame(before + static_cast<std::int64_t>(i) * period, period));
    }
    for (const ByteList& bytes : group.frames) frames.push_back(frame_of(unit, options, bytes, group.at, period));
    before = group.at;
  }
  return frames;
}

namespace {

// Returns the number of bytes that belong to good frames, wherever these begin.
std::size_t bytes_in_frames(const Unit& unit, const Options& options, Bytes bytes, std::size_t& frames) {
  std::size_t sum = 0;
  frames = 0;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = good_frame(unit, options, bytes.subspan(at));
    sum += size;
    frames += size != 0 ? 1 : 0;
    at += std::max<std::size_t>(size, 1);
  }
  return sum;
}

}  // namespace

std::size_t bytes_among_others(const Unit& unit, const Options& options, const StreamBytes& stream) {
  constexpr std::size_t most = 1u << 16;
  const Bytes bytes = Bytes(stream.bytes).first(std::min(stream.bytes.size(), most));
  std::size_t frames = 0;
  const std::size_t within = bytes_in_frames(unit, options, bytes, frames);
  if (frames < enough || within * 2 > bytes.size()) return 0;
  sim::Random random(1);
  ByteList others(bytes.begin(), bytes.end());
  for (std::uint8_t& byte : others) byte ^= static_cast<std::uint8_t>(random.below(256));
  std::size_t by_chance = 0;
  static_cast<void>(bytes_in_frames(unit, options, others, by_chance));
  return frames > 4 * by_chance ? within : 0;
}

}  // namespace absenc::client
