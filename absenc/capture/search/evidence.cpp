// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/search/evidence.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "absenc/core/angle.hpp"

namespace absenc::capture {

namespace {

// number of random replies that are tried if only one or two frames were captured
constexpr unsigned many_attempts = 1u << 20;
// when this number of random replies was accepted, no more are tried: the share of accepted replies is then known to
// some percent
constexpr unsigned enough_accepted = 256;

/// A sink that stores the position that a good reply reports.
struct PositionSink final : FieldSink {
  void put(const FieldValue&) override {}
  void put_reading(const Reading& reading) override {
    if (reading.singleturn_bits != 0) position = reading;
  }
  std::optional<Reading> position;
};

// Returns how many bytes at the beginning of the reply repeat those of the request.
std::size_t repeated(const ObservedExchange& exchange) {
  const auto& request = exchange.request.bytes;
  const auto& reply = exchange.reply.bytes;
  const std::size_t both = std::min(request.size(), reply.size());
  std::size_t count = 0;
  while (count < both && request[count] == reply[count]) ++count;
  return count;
}

double position_of(const Reading& reading) { return static_cast<double>(reading.singleturn); }

// Returns the shortest distance between two positions as a fraction of the whole range.
double relative_distance(const Reading& from, const Reading& to) {
  const double all = std::ldexp(1.0, static_cast<int>(from.singleturn_bits));
  const double difference = std::abs(position_of(to) - position_of(from));
  return (from.unit_um > 0 ? difference : std::min(difference, all - difference)) / all;
}

// Returns log10 of the chance that random positions would be as near to each other as `positions`; nothing if the
// position never changes.
std::optional<double> weigh_motion(std::span<const Reading> positions) {
  double longest = 0;
  std::size_t steps = 0;
  for (std::size_t i = 1; i < positions.size(); ++i) {
    const double one = relative_distance(positions[i - 1], positions[i]);
    if (one <= 0) continue;
    ++steps;
    longest = std::max(longest, one);
  }
  if (steps == 0) return std::nullopt;
  const double least = std::ldexp(1.0, -static_cast<int>(positions[0].singleturn_bits));
  return static_cast<double>(steps - 1) * std::log10(std::min(1.0, 2 * longest + least));
}

/// The different good exchanges, and the chance that the unit accepts random replies.
class Distinct {
 public:
  Distinct(const Unit& unit, const Options& options) : unit_(unit), options_(options) {}

  void add(const ObservedExchange& exchange) {
    const auto same = [&](const ObservedExchange* one) { return *one == exchange; };
    if (std::any_of(all_.begin(), all_.end(), same)) return;
    all_.push_back(&exchange);
  }
  [[nodiscard]] std::size_t count() const { return all_.size(); }
  /// Returns the geometric mean of the probabilities that random replies are accepted.
  [[nodiscard]] double each() {
    if (all_.empty()) return 1;
    double sum = 0;
    for (const ObservedExchange* one : all_) sum += std::log10(acceptance_like(*one));
    return std::pow(10, sum / static_cast<double>(all_.size()));
  }

 private:
  struct KnownAcceptance {
    const ObservedExchange* exchange;
    double acceptance;
  };

  double acceptance_like(const ObservedExchange& exchange) {
    for (const KnownAcceptance& known : known_) {
      const ObservedExchange& other = *known.exchange;
      const bool alike = other.request == exchange.request && other.reply.bytes.size() == exchange.reply.bytes.size() &&
                         other.reply.bits == exchange.reply.bits && repeated(other) == repeated(exchange);
      if (alike) return known.acceptance;
    }
    const unsigned attempts = all_.size() > 2 ? usual_attempts : many_attempts;
    known_.push_back({&exchange, acceptance(unit_, options_, exchange, attempts)});
    return known_.back().acceptance;
  }

  const Unit& unit_;
  const Options& options_;
  std::vector<const ObservedExchange*> all_;
  std::vector<KnownAcceptance> known_;
};

}  // namespace

double Evidence::chance() const { return motion && explains_all() ? frames + *motion : frames; }

double acceptance(const Unit& unit, const Options& options, const ObservedExchange& good, unsigned attempts) {
  // The seed is the length of the reply, so that the same exchange gives the same result each time.
  std::mt19937_64 random(good.reply.bytes.size());
  ObservedExchange noise = good;
  const std::size_t repeated_size = repeated(good);
  unsigned accepted = 0;
  unsigned tried = 0;
  for (; tried < attempts && accepted < enough_accepted; ++tried) {
    std::uint64_t bits = 0;
    const auto fill = [&](auto from, auto to) {
      unsigned left = 0;
      for (auto byte = from; byte != to; ++byte, bits >>= 8, --left) {
        if (left == 0) {
          bits = random();
          left = 8;
        }
        *byte = static_cast<std::uint8_t>(bits);
      }
    };
    fill(noise.reply.bytes.begin() + static_cast<std::ptrdiff_t>(repeated_size), noise.reply.bytes.end());
    if (noise.reply.can) fill(noise.reply.can->data.begin(), noise.reply.can->data.begin() + noise.reply.can->size);
    if (unit.check(options, noise.request.frame(), noise.reply.frame()) == Error::none) ++accepted;
  }
  return std::max(accepted, 1u) / static_cast<double>(tried);
}

bool explains(const Unit& unit, const Options& options, const ObservedExchange& exchange) {
  const Frame reply = exchange.reply.frame();
  return !reply.empty() && unit.check(options, exchange.request.frame(), reply) == Error::none;
}

Evidence weigh(const Unit& unit, const Options& options, std::span<const ObservedExchange> exchanges) {
  Evidence evidence{.tried = exchanges.size()};
  Distinct distinct(unit, options);
  std::vector<Reading> positions;
  for (const ObservedExchange& exchange : exchanges) {
    if (!explains(unit, options, exchange)) continue;
    ++evidence.explained;
    distinct.add(exchange);
    PositionSink sink;
    static_cast<void>(unit.decode(options, exchange.request.frame(), exchange.reply.frame(), sink));
    if (sink.position) positions.push_back(*sink.position);
  }
  evidence.distinct = distinct.count();
  const std::size_t unexplained = evidence.tried - evidence.explained;
  evidence.frames = tail(evidence.distinct, evidence.distinct + unexplained, distinct.each());
  evidence.motion = weigh_motion(positions);
  return evidence;
}

double tail(std::size_t good, std::size_t all, double each) {
  if (good == 0 || each >= 1) return 0;
  const auto n = static_cast<double>(all);
  double sum = 0;  // sum of the probabilities of exactly `good`, `good` + 1 ... events, in multiples of the first one
  double first = 0;
  for (std::size_t k = good; k <= all; ++k) {
    const auto at = static_cast<double>(k);
    const double term = (std::lgamma(n + 1) - std::lgamma(at + 1) - std::lgamma(n - at + 1)) / std::log(10.0) +
                        at * std::log10(each) + (n - at) * std::log10(1 - each);
    if (k == good) first = term;
    sum += std::pow(10, term - first);
  }
  return std::min(0.0, first + std::log10(sum));
}

}  // namespace absenc::capture
