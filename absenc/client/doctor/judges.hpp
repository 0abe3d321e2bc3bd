// SPDX-License-Identifier: Apache-2.0
// The judges of doctor: each adds or returns its findings about one aspect of the observations.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "absenc/client/doctor/observations.hpp"

namespace absenc::client {

struct Case {
  const Unit& unit;
  const Options& options;
  const Observations& seen;
  std::size_t good = 0;
};

/// Returns whether `some` late or missing replies may be due to this computer, because it was busy.
[[nodiscard]] inline bool may_be_the_computer(const Observations& seen, std::uint64_t some) {
  constexpr Time busy = std::chrono::milliseconds(1);
  constexpr Time very_late = std::chrono::milliseconds(50);
  constexpr std::size_t many = 20;
  const std::size_t readings = seen.readings.size();
  Time limit{};
  for (const Attempted& one : seen.readings) limit = std::max(limit, one.limit);
  const bool stood_still = limit > Time{} && seen.computer_late >= std::min(limit, std::max(limit / 4, very_late));
  return seen.computer_late >= busy &&
         (some * 1000 < readings || (some < 2 && readings >= many) || (stood_still && some * 100 < readings));
}

/// Returns whether every bit of every reading was 1, as on a data line at rest; false without readings.
[[nodiscard]] bool all_at_rest(const std::vector<Attempted>& readings);

void judge_port(const Case& one, std::vector<Finding>& findings);
void judge_line(const Case& one, std::vector<Finding>& findings);
void judge_bad_frames(const Case& one, std::vector<Finding>& findings);
/// Adds a finding if good replies consist of nothing but the level of a data line at rest.
void judge_rest(const Case& one, std::vector<Finding>& findings);
[[nodiscard]] std::optional<Finding> coming_and_going(const Case& one);
void judge_mixed_frames(const Case& one, std::vector<Finding>& findings);
/// Returns a finding if the encoder began to reply only during the readings; otherwise nothing.
[[nodiscard]] std::optional<Finding> judge_start(const Case& one);
[[nodiscard]] Finding some_silence(const Observations& seen, std::size_t silent, std::size_t all);
void judge_state(const Case& one, std::vector<Finding>& findings);
/// Adds findings about the positions to `result`, and names there what these positions could not show.
void judge_position(const Case& one, const std::vector<Attempted>& readings, bool by_hand, Examination& result);

/// Returns the beginning of the reply as text, as "1A 20 45".
[[nodiscard]] std::string shown(const Attempted& one);

}  // namespace absenc::client
