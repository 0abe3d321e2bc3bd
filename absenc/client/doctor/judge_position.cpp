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
#include "absenc/host/first_reading.hpp"
#include "absenc/host/speed_limit.hpp"

namespace absenc::client {

namespace {

constexpr double quiet_share = 1e-4;  // fraction of a turn by which a position at rest may vary: 0.036 degrees
constexpr std::int64_t quiet_counts = 4;
constexpr std::uint32_t hand_rpm = 600;

using Place = host::FirstReading::Place;

/// The movement from one valid position to the next.
struct Movement {
  Time pause{};            // time between both readings, as their replies show it
  Time longest = never;    // the time between both readings is not longer; `never`: not known
  std::int64_t step = 0;   // movement within the turn, in the shorter direction
  std::uint64_t way = 0;   // length of the movement, which includes the turns if both readings have valid turns
  unsigned bits = 0;       // number of bits of the positions whose distance is `way`
  bool has_turns = false;  // whether `way` includes the turns
};

/// The valid positions of all readings, and the movement between them.
struct Walk {
  unsigned bits = 0;
  double unit_um = 0;
  std::vector<std::uint64_t> places{};
  std::vector<Movement> movements{};
  // lowest position minus the first position, in counts; the positions are continued past the end of the counter
  std::int64_t lowest = 0;
  std::int64_t highest = 0;
  std::int64_t end = 0;
  std::set<std::int64_t> turns{};  // all numbers of turns that occurred in readings with valid turns
  std::size_t zero_crossings = 0;
  Time time{};  // time from the first to the last reading with a valid position

  [[nodiscard]] std::int64_t span() const { return highest - lowest; }
};

// Returns an upper limit of the time between two positions that answer requests: the first one is latched after its
// request began, the second one before its reply ended. A late computer makes this limit longer, never wrong.
// Returns `never` if the encoder may have sent without a request, or a reply may answer the request before it.
Time longest_pause(LinkKind link, const Attempted& before, const Attempted& now) {
  const auto is_polled = [link](const Attempted& one) {
    const bool characters = link == LinkKind::half_duplex || link == LinkKind::full_duplex;
    return characters && !one.exchange.request.frame().empty() && one.began <= one.reading->latched &&
           one.reading->latched <= one.reading->received;
  };
  return is_polled(before) && is_polled(now) ? now.reading->received - before.began : never;
}

Walk walk_of(LinkKind link, const std::vector<Attempted>& readings) {
  Walk walk;
  const Attempted* last_one = nullptr;
  for (const Attempted& one : readings) {
    if (!one.reading || !one.reading->singleturn_valid() || one.reading->singleturn_bits > 62) continue;
    const Reading& now = *one.reading;
    walk.bits = now.singleturn_bits;
    walk.unit_um = now.unit_um;
    walk.places.push_back(now.singleturn);
    if (now.multiturn_bits != 0 && now.multiturn_validity() == Validity::valid) walk.turns.insert(now.multiturn);
    if (last_one != nullptr) {
      const Reading* before = &*last_one->reading;
      Movement moved{.pause = now.latched - before->latched,
                     .longest = longest_pause(link, *last_one, one),
                     .step = wrapped_difference(now.singleturn, before->singleturn, walk.bits),
                     .bits = walk.bits};
      moved.way = static_cast<std::uint64_t>(std::abs(moved.step));
      const Place place = host::FirstReading::place_of(now);
      if (const Place last = host::FirstReading::place_of(*before); place.is_like(last) && place.has_turns()) {
        moved.way = place.distance(last);
        moved.bits = place.bits;
        moved.has_turns = true;
      }
      walk.movements.push_back(moved);
      walk.end += moved.step;
      const bool up = now.singleturn > before->singleturn;
      walk.zero_crossings += moved.step != 0 && (moved.step > 0) != up ? 1 : 0;
      walk.time += moved.pause;
      walk.lowest = std::min(walk.lowest, walk.end);
      walk.highest = std::max(walk.highest, walk.end);
    }
    last_one = &one;
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
  for (const Movement& movement : walk.movements) {
    const std::int64_t step = movement.step;
    if (step == 0) continue;
    turns += last != 0 && (step > 0) != (last > 0) ? 1 : 0;
    last = step;
    ++moved;
  }
  if (walk.movements.size() < enough || walk.span() <= quiet(walk) || moved * 4 < walk.movements.size()) return;
  // A movement over many counts is no noise; neither is a slow swing, which seldom changes direction.
  const bool wide = walk.unit_um > 0 ? walk.span() > 1000 : walk.span() > (std::int64_t{1} << walk.bits) / 32;
  if (turns * 3 < moved || wide) return;
  const std::string size = walk.unit_um > 0
                               ? fmt::format("{:.3g} um", micrometres(walk.span(), walk.unit_um))
                               : fmt::format("{:.3g} degrees", std::ldexp(360.0 * static_cast<double>(walk.span()),
                                                                          -static_cast<int>(walk.bits)));
  findings.push_back(finding(FindingKind::position_noise, {fmt::format("{}", walk.span()), size}));
}

// Judges whether a shaft or carriage within a speed limit can have moved as the positions of a `Walk` did.
class Movements {
 public:
  // `late`: greatest delay of this computer, by which the time between two readings may be longer than it seems.
  Movements(const Walk& walk, const host::SpeedLimit& limit, Time late)
      : walk_(walk),
        reach_(host::Reach::of(limit, {.singleturn_bits = walk.bits, .unit_um = walk.unit_um})),
        late_(late) {}

  // Returns how many counts the position can move from one reading to the next, with a margin for its noise.
  [[nodiscard]] double reach(const Movement& moved) const {
    return reach(std::min(moved.pause + late_, moved.longest));
  }
  // Returns whether the position moved further than it can move.
  [[nodiscard]] bool is_jump(const Movement& moved) const {
    return is_beyond(static_cast<double>(std::abs(moved.step)), moved);
  }
  // Returns whether position and turns together moved further than they can, though the position within the turn did
  // not.
  [[nodiscard]] bool is_jump_of_turns(const Movement& moved) const {
    return moved.has_turns && !is_jump(moved) && is_beyond(static_cast<double>(moved.way), moved);
  }
  // Returns whether a jump within the turn would be noticed: not if the shaft can reach every position in this time.
  [[nodiscard]] bool can_judge(const Movement& moved) const {
    return moved.pause > Time{} && reach(moved) < static_cast<double>(host::FirstReading::most_judged(walk_.bits));
  }
  // Returns by how many counts the ways between all readings together, of `way` counts, are longer than the position
  // can move in the whole time. Single times may be wrong, because frames wait in adapters and in this computer; their
  // sum is not.
  [[nodiscard]] double excess(double way) const {
    const auto noise = static_cast<double>(quiet(walk_)) * static_cast<double>(walk_.movements.size());
    return way - reach(walk_.time + late_) - noise;
  }

 private:
  [[nodiscard]] double reach(Time time) const {
    return static_cast<double>(reach_.counts(time + time / 4, walk_.bits)) + static_cast<double>(quiet(walk_));
  }
  [[nodiscard]] bool is_beyond(double way, const Movement& moved) const {
    return moved.pause > Time{} && way > reach(moved);
  }

  const Walk& walk_;
  host::Reach reach_;
  Time late_;
};

std::string limit_text(const Walk& walk, const host::SpeedLimit& limit) {
  return walk.unit_um > 0 ? fmt::format("{} mm/s", limit.mm_s) : fmt::format("{} rpm", limit.rpm);
}

// Returns a length of `counts` counts in turns or millimetres.
std::string length_text(const Walk& walk, double counts) {
  return walk.unit_um > 0 ? fmt::format("{:.3g} mm", counts * walk.unit_um / 1000)
                          : fmt::format("{:.3g} turns", std::ldexp(counts, -static_cast<int>(walk.bits)));
}

// Returns the evidence that the positions together are further apart than the shaft can move.
std::string sum_text(const Walk& walk, const host::SpeedLimit& limit, double way) {
  return fmt::format("the ways between {} readings in {} are {} in all, more than {} allow", walk.places.size(),
                     to_text(walk.time), length_text(walk, way), limit_text(walk, limit));
}

// Finds positions that the shaft cannot have reached. Each of `damaged` replies may be a wrong position that passed its
// checksum. Returns whether it found some.
bool judge_jumps(const Walk& walk, const Movements& movements, const host::SpeedLimit& limit, std::size_t damaged,
                 std::vector<Finding>& findings) {
  std::size_t jumps = 0;
  std::int64_t furthest = 0;
  double all = 0;
  for (const Movement& moved : walk.movements) {
    const std::int64_t way = std::abs(moved.step);
    all += static_cast<double>(way);
    if (!movements.is_jump(moved)) continue;
    ++jumps;
    furthest = std::max(furthest, way);
  }
  if (jumps > damaged) {
    findings.push_back(
        finding(FindingKind::position_jumps,
                {fmt::format("{} times the position moved further than a shaft can turn, by up to {} counts", jumps,
                             furthest)}));
  } else if (movements.excess(all) > std::ldexp(static_cast<double>(damaged), static_cast<int>(walk.bits))) {
    findings.push_back(finding(FindingKind::position_jumps, {sum_text(walk, limit, all)}));
  } else {
    return false;
  }
  return true;
}

// Finds turns that are not those of a shaft with these positions.
void judge_turns(const Walk& walk, const Movements& movements, bool by_hand, std::size_t damaged,
                 std::vector<Finding>& findings) {
  if (walk.unit_um > 0 || walk.turns.empty()) return;
  std::size_t jumps = 0;
  double furthest = 0;
  for (const Movement& moved : walk.movements) {
    if (!movements.is_jump_of_turns(moved)) continue;
    ++jumps;
    furthest = std::max(furthest, static_cast<double>(moved.way));
  }
  const bool went_round = by_hand && walk.span() >> walk.bits >= 1;
  if (walk.turns.size() == 1 && (went_round || jumps > damaged)) {
    findings.push_back(finding(FindingKind::turns_stand,
                               {fmt::format("{}", *walk.turns.begin()), fmt::format("{}", walk.zero_crossings)}));
  } else if (jumps > damaged) {
    findings.push_back(finding(FindingKind::turns_jump, {fmt::format("{}", jumps), length_text(walk, furthest)}));
  }
}

constexpr std::size_t enough_turned = 20;  // least number of movements by which a turned shaft is judged

void judge_frozen(const Walk& walk, std::vector<Finding>& findings) {
  if (walk.movements.size() < enough_turned || walk.span() > quiet(walk)) return;
  findings.push_back(
      finding(FindingKind::position_frozen, {fmt::format("{}", std::max(walk.span(), std::int64_t{1})),
                                             fmt::format("{}", walk.places.size()), to_text(walk.time)}));
}

// Finds bits of the position that never change. Needs movements of different sizes between readings: if all are equal,
// even a bit without a fault may never change.
void judge_bits(const Walk& walk, std::vector<Finding>& findings) {
  constexpr std::size_t enough = 64;
  constexpr std::size_t uneven = 8;
  const std::set<std::uint64_t> places(walk.places.begin(), walk.places.end());
  std::set<std::int64_t> steps;
  for (const Movement& moved : walk.movements) steps.insert(moved.step);
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

// Names the jumps that could not be noticed, because the shaft can reach every position from one reading to the next.
void note_unjudged_jumps(const Walk& walk, const Movements& movements, const host::SpeedLimit& limit, bool by_hand,
                         std::vector<std::string>& not_looked_at) {
  const auto is_still = [&](const Movement& moved) { return moved.way <= static_cast<std::uint64_t>(quiet(walk)); };
  if (walk.span() <= quiet(walk) && std::ranges::all_of(walk.movements, is_still)) return;
  std::size_t unjudged = 0;
  bool have_turns = true;  // whether jumps over more turns than the shaft can turn would be noticed
  double furthest = 0;
  for (const Movement& moved : walk.movements) {
    if (movements.can_judge(moved)) continue;
    ++unjudged;
    const double reach = movements.reach(moved);
    have_turns = have_turns && moved.has_turns && moved.pause > Time{} &&
                 reach < static_cast<double>(host::FirstReading::most_judged(moved.bits));
    furthest = std::max(furthest, reach);
  }
  // A few readings far apart, as after a failed reading, do not matter.
  if (unjudged * 10 <= walk.movements.size()) return;
  const bool linear = walk.unit_um > 0;
  const std::string of = have_turns ? fmt::format(" of less than {:.0f} turns",
                                                  std::ceil(std::ldexp(furthest, -static_cast<int>(walk.bits))))
                                    : "";
  const std::string where = unjudged == walk.movements.size()
                                ? ""
                                : fmt::format(" in {} of {} pairs of readings", unjudged, walk.movements.size());
  not_looked_at.push_back(fmt::format("jumps{}{}{} (the {} between two readings at {}: set {})", of, where,
                                      by_hand ? " while the shaft was turned" : "",
                                      have_turns ? "shaft could turn so far"
                                      : linear   ? "carriage could reach any position"
                                                 : "shaft could reach any position",
                                      limit_text(walk, limit), linear ? "max_mm_s" : "max_rpm"));
}

}  // namespace

void judge_position(const Case& one, const std::vector<Attempted>& readings, bool by_hand, Examination& result) {
  std::vector<Finding>& findings = result.findings;
  std::vector<std::string>& not_looked_at = result.not_looked_at;
  const Walk walk = walk_of(one.unit.link, readings);
  if (by_hand && walk.movements.size() < enough_turned) {
    not_looked_at.push_back(fmt::format("a turning shaft (only {} valid positions while it was turned: turn it longer)",
                                        walk.places.size()));
  }
  if (walk.movements.empty()) {
    if (!by_hand) not_looked_at.emplace_back("the movement of the position (fewer than two are said to be valid)");
    return;
  }
  host::SpeedLimit limit = one.seen.limit;
  if (by_hand) {
    limit.rpm = std::min(limit.rpm, hand_rpm);
    judge_frozen(walk, findings);
  } else {
    judge_noise(walk, findings);
  }
  const auto is_damaged = [](const Attempted& reading) { return reading.error != Error::none && reading.heard; };
  const auto damaged = static_cast<std::size_t>(std::ranges::count_if(readings, is_damaged));
  const Movements movements(walk, limit, one.seen.computer_late);
  // Positions that jump pass zero without a turn.
  const bool jumps = judge_jumps(walk, movements, limit, damaged, findings);
  if (!jumps) judge_turns(walk, movements, by_hand, damaged, findings);
  judge_bits(walk, findings);
  note_unjudged_jumps(walk, movements, limit, by_hand, not_looked_at);
  if (by_hand && !walk.turns.empty() && walk.zero_crossings == 0) {
    not_looked_at.emplace_back("the count of turns (the position did not pass zero while the shaft was turned)");
  }
}

}  // namespace absenc::client
