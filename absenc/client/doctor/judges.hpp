// SPDX-License-Identifier: Apache-2.0
// The judges: each adds its findings.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "absenc/client/doctor/observations.hpp"

namespace absenc::client {

/// The observations and the number of good readings among them.
struct Case {
  const Unit& unit;
  const Options& options;
  const Observations& seen;
  std::size_t good = 0;
};

/// Returns whether this number of late or missing replies may be due to this busy computer; an emulator or an adapter's
/// driver on it is delayed, too. That may be a single one among many readings, or one of a hundred if the computer
/// stood still for as long as the timeout.
[[nodiscard]] inline bool may_be_the_computer(const Observations& seen, std::size_t some) {
  constexpr Time busy = std::chrono::milliseconds(1);
  constexpr std::size_t many = 20;
  const std::size_t readings = seen.readings.size();
  Time limit{};
  for (const Attempted& one : seen.readings) limit = std::max(limit, one.limit);
  const bool stood_still = limit > Time{} && seen.woken_late >= limit;
  return seen.woken_late >= busy &&
         (some * 1000 < readings || (some < 2 && readings >= many) || (stood_still && some * 100 < readings));
}

void judge_port(const Case& one, std::vector<Finding>& findings);
void judge_line(const Case& one, std::vector<Finding>& findings);
/// Judges replies of which none is good.
void judge_bad_frames(const Case& one, std::vector<Finding>& findings);
/// Judges bursts of failures with good readings between them.
[[nodiscard]] std::optional<Finding> coming_and_going(const Case& one);
/// Judges replies of which some are good.
void judge_mixed_frames(const Case& one, std::vector<Finding>& findings);
/// Finds an encoder that was powered on meanwhile: no replies at first, then only good readings.
[[nodiscard]] std::optional<Finding> judge_start(const Case& one);
void judge_state(const Case& one, std::vector<Finding>& findings);
void judge_position(const Case& one, const std::vector<Attempted>& readings, bool by_hand,
                    std::vector<Finding>& findings);

/// Returns bytes as "1A 20 45", cut after `most` bytes.
[[nodiscard]] std::string shown(const Attempted& one);

}  // namespace absenc::client
