// SPDX-License-Identifier: Apache-2.0
// The judges of doctor: each adds or returns its findings about one aspect of the observations.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "absenc/client/doctor/observations.hpp"

namespace absenc::client {

/// The observations of one examination, with the unit, its options, and the number of good readings.
struct Case {
  const Unit& unit;
  const Options& options;
  const Observations& seen;
  std::size_t good = 0;
};

/// Returns whether this busy computer may be the cause of `some` late or missing replies. That is so if it was at least
/// 1 ms late once, and they are one of 20 or more readings, or less than one reading in 1000; or less than one in 100,
/// if the computer was late by the timeout, or by the greater of 50 ms and a quarter of the timeout.
[[nodiscard]] inline bool may_be_the_computer(const Observations& seen, std::size_t some) {
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

void judge_port(const Case& one, std::vector<Finding>& findings);
void judge_line(const Case& one, std::vector<Finding>& findings);
/// Adds the finding about damaged replies for an examination in which less than one reading in 20 is good.
void judge_bad_frames(const Case& one, std::vector<Finding>& findings);
/// Returns the finding about bursts of failures with good readings between them; nothing if there are fewer than three
/// bursts, or if they hold less than 70 % of the failures.
[[nodiscard]] std::optional<Finding> coming_and_going(const Case& one);
/// Adds the findings about failed readings for an examination in which at least one reading in 20 is good.
void judge_mixed_frames(const Case& one, std::vector<Finding>& findings);
/// Returns the finding for an encoder that seems to have been powered on during the examination: two or more failed
/// readings, at least half of them without any byte, then only good ones. Returns nothing otherwise, and if chance or a
/// busy computer may be the reason.
[[nodiscard]] std::optional<Finding> judge_start(const Case& one);
/// Returns the finding that `silent` of `all` requests were not answered, or that as many frames of a stream did not
/// come.
[[nodiscard]] Finding some_silence(const Observations& seen, std::size_t silent, std::size_t all);
void judge_state(const Case& one, std::vector<Finding>& findings);
void judge_position(const Case& one, const std::vector<Attempted>& readings, bool by_hand,
                    std::vector<Finding>& findings);

/// Returns the first 16 bytes of the attempt's reply as "1A 20 45", or the received CAN frame as text.
[[nodiscard]] std::string shown(const Attempted& one);

}  // namespace absenc::client
