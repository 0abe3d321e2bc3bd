// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/lines/async.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace absenc::capture {

namespace {

constexpr Tick never = std::numeric_limits<Tick>::max();
constexpr Tick characters_ahead = 12;  // number of characters that are examined to find the first start bit
// number of falling edges that are tried as the first start bit; more than these within one character are noise
constexpr std::size_t candidates = 16;
// number of level changes after which `meet` again compares the characters found with those of a decoder that began in
// a guessed state
constexpr std::size_t step = 64;

}  // namespace

// A falling edge that may begin a character, with the levels of its bits, start bit in bit 0.
struct AsyncDecoder::Candidate {
  Tick begin;
  unsigned levels;
  Tick last;      // time of the last change within the character
  unsigned bits;  // number of bits from the begin of the character to its last change
  Tick next;      // falling edge at which the search for the next character begins
};

AsyncDecoder::Statistics& AsyncDecoder::Statistics::operator+=(const Statistics& other) {
  ticks += other.ticks;
  bits += other.bits;
  characters += other.characters;
  faults += other.faults;
  return *this;
}

AsyncDecoder::Statistics& AsyncDecoder::Statistics::operator-=(const Statistics& other) {
  ticks -= other.ticks;
  bits -= other.bits;
  characters -= other.characters;
  faults -= other.faults;
  return *this;
}

AsyncDecoder::AsyncDecoder(const AsyncFormat& format, std::uint8_t channel, Start start)
    : format_(format),
      channel_(channel),
      stop_(1 + format.data_bits + (format.parity == Parity::none ? 0 : 1)),
      length_(static_cast<Tick>(std::llround(format.bit * (stop_ + format.stop_bits)))),
      per_tick_(1 / format.bit),
      start_(start) {
  // The true time of an edge at tick t is between t - 1 and t, so a fraction of a tick may be cut off.
  for (unsigned i = 0; i < middle_.size(); ++i) middle_[i] = static_cast<Tick>(format.bit * (i + 0.5));
}

void AsyncDecoder::restart(Start start) {
  start_ = start;
  begun_ = false;
  edges_.clear();
  unsure_.reset();
}

// Calls `visit` for the characters from the edge `start` on; `edges_` must end with `never`. Returns the index of the
// edge at which to continue.
template <class Visit>
std::size_t AsyncDecoder::walk(std::size_t start, Tick limit, Tick needed, Visit&& visit) const {
  const Tick* const edges = edges_.data();
  const std::size_t count = edges_.size() - 1;
  const Tick stop = middle_[stop_];
  std::size_t i = start;
  while (i < count && edges[i] < limit && limit - edges[i] >= needed) {
    const Tick begin = edges[i];
    std::size_t j = i + 1;
    unsigned levels = 0;
    unsigned bit = 0;
    for (Tick distance; (distance = edges[j] - begin) <= stop; ++j) {
      bit = static_cast<unsigned>(
          static_cast<std::int64_t>(static_cast<double>(static_cast<std::int64_t>(distance)) * per_tick_));
      bit += middle_[bit] < distance ? 1 : 0;  // index of the first bit whose middle is at the level change or after it
      levels ^= ~0u << bit;
    }
    const std::size_t next = (levels & 1) != 0 ? i + 2 : j + ((j ^ i) & 1);
    if (!visit(Candidate{begin, levels, edges[j - 1], bit, next < count ? edges[next] : never})) return i;
    i = next;
  }
  return i;
}

bool AsyncDecoder::wrong_parity(unsigned levels) const {
  if (format_.parity == Parity::none) return false;
  const unsigned data_and_parity = levels >> 1 & ((2u << format_.data_bits) - 1);
  return (std::popcount(data_and_parity) % 2 != 0) != (format_.parity == Parity::odd);
}

Character AsyncDecoder::character(const Candidate& candidate, Tick limit) const {
  const unsigned levels = candidate.levels;
  const unsigned data = levels >> 1 & ((1u << format_.data_bits) - 1);
  const bool bad_stop = (levels >> stop_ & 1) == 0;
  return {.begin = candidate.begin,
          .end = std::min({candidate.begin + length_, candidate.next, limit}),
          .value = static_cast<std::uint8_t>(data),
          .channel = channel_,
          .high = static_cast<std::uint8_t>(data >> 8),
          .bad_parity = wrong_parity(levels),
          .bad_stop = bad_stop,
          .is_break = bad_stop && (levels & ((2u << stop_) - 1)) == 0};
}

std::uint64_t AsyncDecoder::faults_from(std::size_t start, Tick limit) const {
  std::uint64_t faults = 0;
  walk(start, limit, middle_[stop_] + 1, [&](const Candidate& candidate) {
    const unsigned levels = candidate.levels;
    faults += (levels & 1) != 0 || (levels >> stop_ & 1) == 0 || wrong_parity(levels) ? 1 : 0;
    return true;
  });
  return faults;
}

// Returns the index of the edge that begins the first start bit, or nothing if it is not known.
std::optional<std::size_t> AsyncDecoder::find_start(Tick limit, bool final) const {
  const std::size_t count = edges_.size() - 1;
  const std::size_t first = level_ ? 0 : 1;
  if (first >= count) return std::nullopt;
  const Tick begin = edges_[first];
  if (begin - (level_ ? origin_ : edges_[0]) >= length_) return first;
  const Tick horizon = begin + characters_ahead * length_;
  if (!final && limit < horizon) return std::nullopt;
  std::size_t best = first;
  std::uint64_t fewest = std::numeric_limits<std::uint64_t>::max();
  for (std::size_t i = first; i < count && i < first + 2 * candidates && edges_[i] - begin <= length_; i += 2) {
    const std::uint64_t faults = faults_from(i, std::min(limit, horizon));
    if (faults >= fewest) continue;
    best = i;
    fewest = faults;
  }
  return best;
}

void AsyncDecoder::begin_part(const Changes& part, Tick first) {
  const bool before = part.before == format_.idle_high;
  if (!begun_) {
    begun_ = true;
    origin_ = end_ = first;
    line_ = level_ = before;
  }
  if (line_ != before) feed({&first, 1}, first + 1);
}

void AsyncDecoder::feed(std::span<const Tick> edges, Tick end) {
  line_ = line_ != (edges.size() % 2 != 0);
  end_ = end;
  if (format_.glitch == 0) {
    edges_.insert(edges_.end(), edges.begin(), edges.end());
    return;
  }
  for (const Tick edge : edges) {
    if (unsure_ && edge - *unsure_ < format_.glitch) {
      unsure_.reset();
      continue;
    }
    if (unsure_) edges_.push_back(*unsure_);
    unsure_ = edge;
  }
  if (unsure_ && end - *unsure_ >= format_.glitch) {
    edges_.push_back(*unsure_);
    unsure_.reset();
  }
}

void AsyncDecoder::drop(std::size_t edges) {
  level_ = level_ != (edges % 2 != 0);
  edges_.erase(edges_.begin(), edges_.begin() + static_cast<std::ptrdiff_t>(edges));
}

std::optional<std::size_t> AsyncDecoder::run(bool final, std::span<const Character> targets,
                                             std::vector<Character>& characters) {
  if (final && unsure_) {
    edges_.push_back(*unsure_);
    unsure_.reset();
  }
  const Tick limit = unsure_.value_or(end_);
  edges_.push_back(never);
  std::optional<std::size_t> met;
  std::optional<std::size_t> start = level_ ? 0 : 1;
  if (start_ == Start::search) start = find_start(limit, final);
  std::size_t done = 0;
  if (start) {
    start_ = Start::trust;
    std::size_t target = 0;
    Statistics sum;
    const Tick needed = final ? middle_[stop_] + 1 : std::max(length_, middle_[stop_] + 1);
    done = walk(*start, limit, needed, [&](const Candidate& candidate) {
      if (!targets.empty()) {
        while (target < targets.size() && targets[target].begin < candidate.begin) ++target;
        if (target < targets.size() && targets[target].begin == candidate.begin) {
          met = target;
          return false;
        }
      }
      if ((candidate.levels & 1) != 0) {
        ++sum.faults;
        return true;
      }
      const Character& made = characters.emplace_back(character(candidate, limit));
      const bool bad = made.bad_stop || made.bad_parity;
      ++sum.characters;
      sum.faults += bad ? 1 : 0;
      sum.ticks += bad ? 0 : candidate.last - candidate.begin;
      sum.bits += bad ? 0 : candidate.bits;
      return true;
    });
    statistics_ += sum;
  }
  edges_.pop_back();
  drop(std::min(done, edges_.size()));
  return met;
}

void AsyncDecoder::decode(const Changes& part, Tick first, Tick end, std::vector<Character>& characters) {
  begin_part(part, first);
  feed(part.at, end);
  run(false, {}, characters);
}

std::optional<std::size_t> AsyncDecoder::meet(const Changes& part, Tick first, Tick end,
                                              std::span<const Character> targets, std::vector<Character>& characters) {
  const std::span<const Tick> edges = part.at;
  begin_part(part, first);
  for (std::size_t fed = 0;;) {
    const std::size_t count = std::min(step, edges.size() - fed);
    const std::size_t after = fed + count;
    feed(edges.subspan(fed, count), after < edges.size() ? edges[after] : end);
    fed = after;
    if (const auto met = run(false, targets, characters)) return met;
    if (fed == edges.size()) return std::nullopt;
  }
}

void AsyncDecoder::join(const Changes& part, Tick first, Tick end, AsyncDecoder& other, std::vector<Character>& guessed,
                        std::vector<Character>& characters) {
  const Statistics theirs = std::exchange(other.statistics_, {});
  const auto met = meet(part, first, end, guessed, characters);
  if (!met) return;
  characters.insert(characters.end(), guessed.begin() + static_cast<std::ptrdiff_t>(*met), guessed.end());
  // The errors that `other`, which began in a guessed state, counted before it met this decoder are wrong: a decoder
  // that begins in the same state counts them again, and they are subtracted.
  AsyncDecoder wrong(format_, channel_, Start::trust);
  std::vector<Character> ignored;
  wrong.meet(part, first, end, std::span(guessed).subspan(*met, 1), ignored);
  statistics_ += theirs;
  statistics_ -= wrong.statistics_;
  line_ = other.line_;
  level_ = other.level_;
  end_ = other.end_;
  unsure_ = other.unsure_;
  edges_.swap(other.edges_);
}

void AsyncDecoder::finish(std::vector<Character>& characters) {
  if (begun_) run(true, {}, characters);
  restart();
}

Tick AsyncDecoder::settled() const {
  if (!edges_.empty()) return edges_.front();
  return unsure_.value_or(end_);
}

}  // namespace absenc::capture
