// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/campaign/guarded.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <vector>

#include "absenc/host/first_reading.hpp"
#include "absenc/host/speed_limit.hpp"
#include "absenc/sim/place.hpp"

namespace absenc::client {

namespace {

using namespace std::chrono_literals;

// Returns `difference`, of two positions on a circle of 2^bits counts, as a signed number.
std::int64_t wrapped(std::uint64_t difference, unsigned bits) {
  const unsigned unused = 64 - bits;
  return static_cast<std::int64_t>(difference << unused) >> unused;
}

/// A shaft that stores the times and positions of its last 16 measurements.
class MeasuredShaft final : public Shaft {
 public:
  MeasuredShaft(std::int64_t start, double turns_a_second) : start_(start), speed_(turns_a_second) {}

  [[nodiscard]] ShaftState at(Time time) const override {
    const double seconds = std::chrono::duration<double>(std::max(time - Time(1ms), Time{})).count();
    const std::int64_t position = start_ + static_cast<std::int64_t>(std::ldexp(speed_ * seconds, 32));
    samples_[count_++ % samples_.size()] = {time, position};
    return {.position = position, .speed_millirpm = seconds > 0 ? static_cast<std::int32_t>(60'000 * speed_) : 0};
  }

  /// Returns whether the shaft had the position of the reading in a stored measurement that is at most 2 ms from the
  /// reading's latch time.
  [[nodiscard]] bool was_at(const Reading& reading) const { return find(reading) != nullptr; }
  /// Returns the true position of the shaft at the time of the reading, also if the reading has another position.
  [[nodiscard]] std::int64_t place_of(const Reading& reading) const {
    const ShaftSample* found = find(reading);
    for (std::size_t i = 0; found == nullptr && i < count(); ++i) {
      if (last(i).at <= reading.received || i + 1 == count()) found = &last(i);
    }
    return found->position;
  }

 private:
  struct ShaftSample {
    Time at{};
    std::int64_t position = 0;
  };

  // Returns a stored measurement; `number` counts backwards from 0, the newest.
  [[nodiscard]] const ShaftSample& last(std::size_t number) const {
    return samples_[(count_ - 1 - number) % samples_.size()];
  }
  [[nodiscard]] std::size_t count() const { return std::min(count_, samples_.size()); }
  [[nodiscard]] const ShaftSample* find(const Reading& reading) const {
    // tolerance of the time of a measurement: an encoder may measure more often than it is polled
    constexpr Time vague = 2ms;
    for (std::size_t i = 0; i < count(); ++i) {
      const bool then = last(i).at >= reading.latched - vague && last(i).at <= reading.latched + vague;
      if (then && sim::is_at(reading, last(i).position)) return &last(i);
    }
    return nullptr;
  }

  std::int64_t start_;
  double speed_;
  mutable std::array<ShaftSample, 16> samples_{};
  mutable std::size_t count_ = 0;
};

/// Computes how many wrong positions the host confirms by mistake.
class LetThrough {
 public:
  LetThrough(const Resolution& resolution, const host::SpeedLimit& limit, unsigned bits)
      : counts_per_second_(host::counts_per_second(resolution, limit)), bits_(bits) {}

  void add_position() { ++positions_; }
  /// Adds a reading with a wrong position to the statistics. `away`: wrong minus true position, in counts.
  void add_wrong(std::int64_t away) { away_.push_back(away); }
  /// Adds two consecutive readings to the statistics. `between`: time from one to the other; `moved`: counts by which
  /// the shaft moved during this time; `before`: value of `moved` for the two readings before.
  void add_comparison(Time between, std::int64_t moved, std::int64_t before) {
    comparisons_.push_back({between, moved, before});
  }

  [[nodiscard]] Share wrong() const { return {away_.size(), positions_}; }

  /// Returns the expected number of wrong positions that are confirmed, if readings are wrong independently of each
  /// other.
  [[nodiscard]] double expected() const {
    if (away_.empty()) return 0;
    constexpr unsigned draws = 16;
    const double share = wrong().rate();
    sim::Random random(1);
    std::uint64_t agreed = 0;
    const auto drawn = [&](double often) {
      return random.chance(often) ? static_cast<std::uint64_t>(away_[random.below(away_.size())]) : 0;
    };
    for (const ShaftMovement& one : comparisons_) {
      for (unsigned i = 0; i < draws; ++i) {
        const std::uint64_t first = drawn(share);
        const std::uint64_t second = drawn(share);
        const std::uint64_t step = static_cast<std::uint64_t>(one.moved) + drawn(1) - second;
        const std::uint64_t before = static_cast<std::uint64_t>(one.before) + second - first;
        if (agrees(one.between, step, before)) ++agreed;
      }
    }
    return share * static_cast<double>(agreed) / draws;
  }

 private:
  struct ShaftMovement {
    Time between;
    std::int64_t moved;
    std::int64_t before;
  };

  // Returns whether the host would accept a movement of `step` counts after a movement of `before` counts.
  [[nodiscard]] bool agrees(Time between, std::uint64_t step, std::uint64_t before) const {
    const double most = std::ldexp(15.0 / 32, static_cast<int>(bits_));
    const double reached = 4 + counts_per_second_ * std::chrono::duration<double>(between).count();
    const double allowed = std::min(reached, most);
    if (distance(step) <= allowed) return true;
    return distance(step) <= 4 * reached && distance(before) > allowed &&
           distance(step - before) <= std::min(allowed, most / 8);
  }
  [[nodiscard]] double distance(std::uint64_t step) const {
    return std::abs(static_cast<double>(wrapped(step, bits_)));
  }

  double counts_per_second_;
  unsigned bits_;
  std::uint64_t positions_ = 0;
  std::vector<std::int64_t> away_;
  std::vector<ShaftMovement> comparisons_;
};

double turns_a_second(const Resolution& resolution, double rpm) {
  if (resolution.unit_um == 0) return rpm / 60;
  // A simulated linear encoder moves over its whole scale in one revolution of the shaft.
  return rpm * 1000 / resolution.unit_um / std::ldexp(1.0, static_cast<int>(resolution.singleturn_bits));
}

template <class Item>
class GuardedCampaign {
 public:
  GuardedCampaign(const Unit& unit, const Options& options, const Rates& rates, const CampaignChoices& choices)
      : read_(*find_command(unit, Verb::read)),
        resolution_(unit.resolution(options)),
        shaft_(static_cast<std::int64_t>(sim::Random(choices.seed).next()), turns_a_second(resolution_, *choices.rpm)),
        bench_(unit, options, shaft_, rates, choices.seed),
        limit_(limit_of(options, choices)),
        let_through_(resolution_, limit_, bits_of_a_good_reading()) {
    bench_.session.set_speed_limit(limit_);
    bench_.set_faults(true);
  }

  Guarded run(std::uint64_t exchanges, CampaignResult& result) {
    Guarded guarded;
    while (result.exchanges < exchanges) one(result, guarded);
    result.damaged = bench_.damaged();
    result.failed = {bench_.session.counters().bad() - refused(), result.exchanges};
    result.given_up.of = result.changed.of = guarded.confirmed.of = result.readings;
    guarded.wrong.of = guarded.confirmed.count;
    guarded.alone = let_through_.wrong();
    guarded.let_through = let_through_.expected();
    return guarded;
  }

 private:
  static host::SpeedLimit limit_of(const Options& options, const CampaignChoices& choices) {
    host::SpeedLimit limit = host::speed_limit(options);
    if (choices.maximum_rpm != 0) limit = {.rpm = choices.maximum_rpm, .mm_s = choices.maximum_rpm};
    return limit;
  }

  // Returns the number of bits of the position and, if they are valid, of the turns: the host compares both as one
  // number.
  static unsigned bits_of(const Reading& reading) {
    return reading.singleturn_bits + (reading.multiturn_valid ? reading.multiturn_bits : 0);
  }
  static std::uint64_t counts_of(const Reading& reading) {
    return reading.multiturn_valid ? reading.multiturn << reading.singleturn_bits | reading.singleturn
                                   : reading.singleturn;
  }
  std::uint64_t counts_at(std::int64_t place) const {
    const std::uint64_t turns = sim::turns_at(place, bits_ - resolution_.singleturn_bits);
    const std::uint64_t counts = sim::counts_at(place, resolution_.singleturn_bits);
    return bits_ > resolution_.singleturn_bits ? turns << resolution_.singleturn_bits | counts : counts;
  }

  unsigned bits_of_a_good_reading() {
    bench_.set_faults(false);
    const Conversation<Item>* ended = bench_.session.read(read_, host::Take::every);
    if (ended->reading() == nullptr) return resolution_.singleturn_bits;
    resolution_.singleturn_bits = ended->reading()->singleturn_bits;
    return bits_ = bits_of(*ended->reading());
  }

  std::uint64_t refused() const {
    return bench_.session.counters().errors[static_cast<std::size_t>(Error::cross_check_failed)];
  }

  void hear(const Reading& reading) {
    if (!host::FirstReading::has_position(reading)) {
      has_last_ = false;
      return;
    }
    const std::int64_t place = shaft_.place_of(reading);
    let_through_.add_position();
    if (!shaft_.was_at(reading) && bits_of(reading) == bits_) {
      let_through_.add_wrong(wrapped(counts_of(reading) - counts_at(place), bits_));
    }
    if (has_last_) {
      const std::int64_t moved = wrapped(counts_at(place) - counts_at(last_), bits_);
      let_through_.add_comparison(reading.latched - last_latched_, moved, moved_);
      moved_ = moved;
    }
    last_ = place;
    last_latched_ = reading.latched;
    has_last_ = true;
  }

  void one(CampaignResult& result, Guarded& guarded) {
    const sim::RoughCounts before = bench_.line.counts();
    const Conversation<Item>* ended =
        bench_.session.read(read_, host::Take::every, [this](const Reading& reading) { hear(reading); });
    ++result.readings;
    result.exchanges += bench_.exchanges_since(before);
    const auto right = [this](const Reading& reading) { return shaft_.was_at(reading); };
    if (ended->error() != Error::none) {
      ++result.given_up.count;
      if (ended->error() == Error::timeout) has_last_ = false;
      if (bench_.rates.line.late > 0) bench_.pause();
      if (bench_.was_changed(read_, right)) ++result.changed.count;
      return;
    }
    if (!bench_.session.confirmed()) return;
    ++guarded.confirmed.count;
    if (shaft_.was_at(*ended->reading())) return;
    if (bench_.was_changed(read_, right)) {
      ++result.changed.count;
      return;
    }
    ++guarded.wrong.count;
  }

  const Command& read_;
  Resolution resolution_;
  unsigned bits_ = 0;
  MeasuredShaft shaft_;
  RoughBench<Item> bench_;
  host::SpeedLimit limit_;
  LetThrough let_through_;
  bool has_last_ = false;
  std::int64_t last_ = 0;
  Time last_latched_{};
  std::int64_t moved_ = 0;
};

}  // namespace

Guarded read_guarded(const Unit& unit, const Options& options, const Rates& rates, const CampaignChoices& choices,
                     CampaignResult& result) {
  if (unit.link == LinkKind::can) {
    return GuardedCampaign<CanFrame>(unit, options, rates, choices).run(choices.exchanges, result);
  }
  return GuardedCampaign<std::uint8_t>(unit, options, rates, choices).run(choices.exchanges, result);
}

}  // namespace absenc::client
