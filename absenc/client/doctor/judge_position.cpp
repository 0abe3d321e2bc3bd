// SPDX-License-Identifier: Apache-2.0
// Judges whether positions are those of a shaft.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include "absenc/client/doctor/judges.hpp"
#include "absenc/client/doctor/words.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/speed_limit.hpp"

namespace absenc::client {

namespace {

constexpr double quiet_share = 1e-4;  // fraction of a turn by which a position at rest may vary: 0.036 degrees
constexpr std::int64_t quiet_counts = 4;
constexpr std::uint32_t hand_rpm = 600;

/// The valid positions of all readings, and the movement between them.
struct Walk {
  unsigned bits = 0;
  double unit_um = 0;
  std::vector<std::uint64_t> places{};
  std::vector<std::int64_t> steps{};
  std::vector<Time> pauses{};
  // lowest position minus the first position, in counts; the positions are continued past the end of the counter
  std::int64_t lowest = 0;
  std::int64_t highest = 0;
  std::int64_t end = 0;
  std::set<std::int64_t> turns{};  // all numbers of turns that occurred in readings with valid turns
  std::size_t zero_crossings = 0;
  Time time{};  // time from the first to the last reading with a valid position

  [[nodiscard]] std::int64_t span() const { return highest - lowest; }
};

Walk walk_of(const std::vector<Attempted>& readings) {
  Walk walk;
  const Reading* before = nullptr;
  for (const Attempted& one : readings) {
    if (!one.reading || !one.reading->singleturn_valid() || one.reading->singleturn_bits > 62) continue;
    const Reading& now = *one.reading;
    walk.bits = now.singleturn_bits;
    walk.unit_um = now.unit_um;
    walk.places.push_back(now.singleturn);
    if (now.multiturn_bits != 0 && now.multiturn_validity() == Validity::valid) walk.turns.insert(now.multiturn);
    if (before != nullptr) {
      const std::int64_t step = wrapped_difference(now.singleturn, before->singleturn, walk.bits);
      walk.steps.push_back(step);
      walk.pauses.push_back(now.latched - before->latched);
      walk.end += step;
      const bool up = now.singleturn > before->singleturn;
      walk.zero_crossings += step != 0 && (step > 0) != up ? 1 : 0;
      walk.time += walk.pauses.back();
      walk.lowest = std::min(walk.lowest, walk.end);
      walk.highest = std::max(walk.highest, walk.end);
    }
    before = &now;
  }
  return walk;
}

std::int64_t quiet(const Walk& walk) {
  if (walk.unit_um > 0) return quiet_counts * 4;
  return std::max(quiet_counts, static_cast<std::int64_t>(std::ldexp(quiet_share, static_cast<int>(walk.bits))));
}

// Finds noise of the position: noise changes direction all the time, unlike a shaft that turns or swings.
void judge_noise(const Walk& walk, std::vector<Finding>& findings) {
  constexpr std::size_t enough = 40;
  std::size_t turns = 0;
  std::size_t moved = 0;
  std::int64_t last = 0;
  for (const std::int64_t step : walk.steps) {
    if (step == 0) continue;
    turns += last != 0 && (step > 0) != (last > 0) ? 1 : 0;
    last = step;
    ++moved;
  }
  if (walk.steps.size() < enough || walk.span() <= quiet(walk) || moved * 4 < walk.steps.size()) return;
  // A movement over many counts is no noise; neither is a slow swing, which seldom changes direction.
  const bool wide = walk.unit_um > 0 ? walk.span() > 1000 : walk.span() > (std::int64_t{1} << walk.bits) / 32;
  if (turns * 3 < moved || wide) return;
  const std::string size = walk.unit_um > 0
                               ? fmt::format("{:.3g} um", micrometres(walk.span(), walk.unit_um))
                               : fmt::format("{:.3g} degrees", std::ldexp(360.0 * static_cast<double>(walk.span()),
                                                                          -static_cast<int>(walk.bits)));
  findings.push_back(finding(FindingKind::position_noise, {fmt::format("{}", walk.span()), size}));
}

// Returns how many counts the position can move in the time `pause`.
double reach(const Walk& walk, Time pause, const host::SpeedLimit& limit) {
  const double seconds = std::chrono::duration<double>(pause).count();
  const double counts =
      walk.unit_um > 0 ? limit.mm_s * 1000.0 / walk.unit_um : std::ldexp(limit.rpm / 60.0, static_cast<int>(walk.bits));
  return 1.25 * counts * seconds + static_cast<double>(quiet(walk));
}

// Finds positions that the shaft cannot have reached.
void judge_jumps(const Walk& walk, const host::SpeedLimit& limit, Time computer_late, std::size_t damaged,
                 std::vector<Finding>& findings) {
  std::size_t jumps = 0;
  std::int64_t furthest = 0;
  for (std::size_t i = 0; i < walk.steps.size(); ++i) {
    const auto way = std::abs(walk.steps[i]);
    if (walk.pauses[i] <= Time{} || static_cast<double>(way) <= reach(walk, walk.pauses[i] + computer_late, limit))
      continue;
    ++jumps;
    furthest = std::max(furthest, way);
  }
  if (jumps <= damaged) return;
  findings.push_back(finding(FindingKind::position_jumps, {fmt::format("{}", jumps), fmt::format("{}", furthest)}));
}

void judge_turning(const Walk& walk, std::vector<Finding>& findings) {
  constexpr std::size_t enough = 20;
  if (walk.steps.size() < enough) return;
  if (walk.span() <= quiet(walk)) {
    findings.push_back(
        finding(FindingKind::position_frozen, {fmt::format("{}", std::max(walk.span(), std::int64_t{1})),
                                               fmt::format("{}", walk.places.size()), to_text(walk.time)}));
  }
  const bool went_round = walk.unit_um == 0 && walk.span() >> walk.bits >= 1;
  if (went_round && walk.turns.size() == 1) {
    findings.push_back(finding(FindingKind::turns_stand,
                               {fmt::format("{}", *walk.turns.begin()), fmt::format("{}", walk.zero_crossings)}));
  }
}

// Finds bits of the position that never change. Needs movements of different sizes between readings: if all are equal,
// even a bit without a fault may never change.
void judge_bits(const Walk& walk, std::vector<Finding>& findings) {
  constexpr std::size_t enough = 64;
  constexpr std::size_t uneven = 8;
  const std::set<std::uint64_t> places(walk.places.begin(), walk.places.end());
  const std::set<std::int64_t> steps(walk.steps.begin(), walk.steps.end());
  if (places.size() < enough || steps.size() < uneven) return;
  std::uint64_t changed = 0;
  for (const std::uint64_t place : walk.places) changed |= place ^ walk.places.front();
  std::string names;
  for (unsigned bit = 0; bit + 3 < walk.bits && walk.span() >> (bit + 3) != 0; ++bit) {
    if ((changed >> bit & 1) == 0) names += fmt::format("{}{}", names.empty() ? "bit " : ", bit ", bit);
  }
  if (names.empty()) return;
  findings.push_back(finding(FindingKind::stuck_bits, {names, fmt::format("{}", walk.span())}));
}

}  // namespace

void judge_position(const Case& one, const std::vector<Attempted>& readings, bool by_hand,
                    std::vector<Finding>& findings) {
  const Walk walk = walk_of(readings);
  if (walk.steps.empty()) return;
  host::SpeedLimit limit = one.seen.limit;
  if (by_hand) limit.rpm = std::min(limit.rpm, hand_rpm);
  if (by_hand) {
    judge_turning(walk, findings);
  } else {
    judge_noise(walk, findings);
  }
  const auto is_damaged = [](const Attempted& reading) { return reading.error != Error::none && reading.heard; };
  const auto damaged = static_cast<std::size_t>(std::ranges::count_if(readings, is_damaged));
  judge_jumps(walk, limit, one.seen.computer_late, damaged, findings);
  judge_bits(walk, findings);
}

}  // namespace absenc::client
