// SPDX-License-Identifier: Apache-2.0
// Decides whether the shaft stands still, and whether a zero may be set.
#pragma once

#include <algorithm>
#include <cstdint>

#include "absenc/core/angle.hpp"
#include "absenc/core/time.hpp"
#include "absenc/protocol/author/routine.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::author {

/// Time between the two readings by which a host decides whether the shaft stands still.
inline constexpr Time between_looks = std::chrono::milliseconds(10);
/// Greatest difference of two positions of a standing shaft, caused by noise, in 1/1000 degree.
inline constexpr std::uint32_t standstill_millidegrees = 20;
/// Greatest distance of the position from 0 after a zero was set, in 1/1000 degree.
inline constexpr std::uint32_t zero_millidegrees = 350;

/// Returns an angle of `millidegrees` (1/1000 degree) in counts of a circle with 2^bits counts; at least 1.
[[nodiscard]] constexpr std::int64_t counts_of_angle(unsigned bits,
                                                     std::uint32_t millidegrees = standstill_millidegrees) {
  const unsigned more = bits > 40 ? bits - 40 : 0;
  const std::uint64_t counts = (std::uint64_t{millidegrees} << (bits - more)) / 360'000 << more;
  return std::max<std::int64_t>(static_cast<std::int64_t>(counts), 1);
}

/// Returns whether two positions of `bits` bits (1 to 63) differ by at most `most` counts.
[[nodiscard]] constexpr bool is_within(std::uint64_t counts, std::uint64_t other, unsigned bits, std::int64_t most) {
  const std::int64_t apart = wrapped_difference(counts, other, bits);
  return apart <= most && -apart <= most;
}
/// Returns whether two positions of `bits` bits (1 to 63) differ by at most `millidegrees`, or by one count.
[[nodiscard]] constexpr bool is_near(std::uint64_t counts, std::uint64_t other, unsigned bits,
                                     std::uint32_t millidegrees = standstill_millidegrees) {
  return is_within(counts, other, bits, counts_of_angle(bits, millidegrees));
}

/// Notes in `routine` what the position `now` shows of a request that was to make it `wanted`. `before`: the position
/// before the request; all of them have `bits` bits. `limit`: greatest distance in counts of a position that counts as
/// the wanted one; `still`: the same for an unchanged position.
inline void note_placed(Routine& routine, std::uint64_t before, std::uint64_t now, std::uint64_t wanted, unsigned bits,
                        std::int64_t limit, std::int64_t still) {
  const bool is_there = is_within(now, wanted, bits, limit);
  if (is_there && is_within(before, wanted, bits, limit)) {
    routine.unproven(
        "the position was already there before, to within the tolerance of the check (0.35 degrees at most), so it "
        "cannot show whether the encoder obeyed: turn the shaft and try again");
  } else if (!is_there && is_within(now, before, bits, still)) {
    routine.refused();
  }
}
/// Notes in `routine` what the position `now` shows of a zero; `millidegrees`: greatest distance from 0.
inline void note_zero(Routine& routine, std::uint64_t before, std::uint64_t now, unsigned bits,
                      std::uint32_t millidegrees = zero_millidegrees) {
  note_placed(routine, before, now, 0, bits, counts_of_angle(bits, millidegrees), counts_of_angle(bits));
}

/// Notes in `routine` if the command of this purpose, which was obeyed, changed turns or position that it must leave.
/// The turns of a standing shaft may change by one, because its position may pass zero.
inline void note_side_effects(Routine& routine, Verb verb, const Reading& before, const Reading& now) {
  const bool has_turns = before.multiturn_validity() == Validity::valid && now.multiturn_validity() == Validity::valid;
  const std::int64_t turns = has_turns ? wrapped_difference(now.multiturn, before.multiturn, now.multiturn_bits) : 0;
  const bool has_moved = verb != Verb::zero && !is_near(now.singleturn, before.singleturn, now.singleturn_bits);
  const bool has_turned = verb != Verb::reset_multiturn && (turns < -1 || turns > 1);
  if (!routine.noted().empty() || (!has_moved && !has_turned)) return;
  routine.note_change(has_turned ? "the turns changed too, though the shaft stood still: compare them with those before"
                                 : "the position within the turn changed too, though the shaft stood still: find the "
                                   "origin again");
}

/// Returns not_still if two readings `between_looks` apart show a turning shaft; else no error.
[[nodiscard]] constexpr Outcome objection_to_moving(const Reading& first, const Reading& second) {
  if (is_near(second.singleturn, first.singleturn, second.singleturn_bits)) return {};
  return {Error::not_still, "nothing was changed"};
}

/// Returns why a zero must not be set after these two readings: invalid_argument or not_still. No error: a zero may be
/// set.
[[nodiscard]] constexpr Outcome objection_to_zero(const Reading& first, const Reading& second) {
  for (const Reading& look : {first, second}) {
    if (!look.ready) {
      return {Error::invalid_argument,
              "the encoder is still starting, and its position does not hold yet; nothing was changed",
              "wait until it has started, then try again"};
    }
    if (look.singleturn_validity() == Validity::invalid) {
      return {Error::invalid_argument,
              "the position does not hold, and a zero made of it would be wrong; nothing was changed",
              "mend what `absenc alarms` names, then try again"};
    }
  }
  return objection_to_moving(first, second);
}

}  // namespace absenc::author
