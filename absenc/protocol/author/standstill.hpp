// SPDX-License-Identifier: Apache-2.0
// What counts as standing still, as an angle, and when a zero must not be set: each stated once.
#pragma once

#include <algorithm>
#include <cstdint>

#include "absenc/core/angle.hpp"
#include "absenc/core/time.hpp"
#include "absenc/protocol/author/routine.hpp"

namespace absenc::author {

/// Two looks at a shaft so far apart show whether it turns: at 0.33 rpm and more.
inline constexpr Time between_looks = std::chrono::milliseconds(10);
/// What noise may make of it.
inline constexpr std::uint32_t standstill_millidegrees = 20;
/// How far from 0 a zero may be that was set, where the document does not say how exact it is.
inline constexpr std::uint32_t zero_millidegrees = 350;

/// This angle on a circle of 2^bits counts (1 to 64), one count at least.
[[nodiscard]] constexpr std::int64_t counts_of_angle(unsigned bits,
                                                     std::uint32_t millidegrees = standstill_millidegrees) {
  const unsigned more = bits > 40 ? bits - 40 : 0;
  const std::uint64_t counts = (std::uint64_t{millidegrees} << (bits - more)) / 360'000 << more;
  return std::max<std::int64_t>(static_cast<std::int64_t>(counts), 1);
}

/// Whether two places on a circle of 2^bits counts (1 to 63) are no further apart than this angle, or one count.
[[nodiscard]] constexpr bool is_near(std::uint64_t counts, std::uint64_t other, unsigned bits,
                                     std::uint32_t millidegrees = standstill_millidegrees) {
  const std::int64_t apart = wrapped_difference(counts, other, bits);
  const std::int64_t limit = counts_of_angle(bits, millidegrees);
  return apart <= limit && -apart <= limit;
}

/// Why a command that needs the shaft to stand still must not be sent after these two looks, `between_looks` apart:
/// not_still; no error: it may.
[[nodiscard]] constexpr Outcome objection_to_moving(const Reading& first, const Reading& second) {
  if (is_near(second.singleturn, first.singleturn, second.singleturn_bits)) return {};
  return {Error::not_still, "nothing was changed"};
}

/// The same of a zero, which is wrong for ever where the position that it is made of does not hold: invalid_argument.
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
