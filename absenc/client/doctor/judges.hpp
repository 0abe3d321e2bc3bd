// SPDX-License-Identifier: Apache-2.0
// The parts of the judgement: each adds what it finds.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "absenc/client/doctor/observations.hpp"

namespace absenc::client {

/// What was seen, and how many of its readings were good.
struct Case {
  const Unit& unit;
  const Options& options;
  const Observations& seen;
  std::size_t good = 0;
};

[[nodiscard]] inline bool is_good(const Attempted& one) { return one.error == Error::none; }

/// Whether nothing answered: an adapter's echo of the request is no answer.
[[nodiscard]] inline bool is_silent(const Attempted& one) {
  const bool is_echo = !one.answered && one.raw == one.exchange.request.bytes;
  return one.error != Error::none && (!one.heard || is_echo);
}

/// Whether so many replies that were late or did not come may be due to this computer, which was busy: the encoder may
/// be a program on it, or an adapter whose driver waits, too. A single one may be where there are many readings, and
/// one of a hundred where the computer stood still for as long as a reply may take.
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
/// Of replies of which none is good.
void judge_bad_frames(const Case& one, std::vector<Finding>& findings);
/// So many of the requests that were not answered, or of the frames that an encoder was to send by itself.
[[nodiscard]] Finding silence_of(const Case& one, std::size_t silent);
/// Failures that come together, with pauses between them.
[[nodiscard]] std::optional<Finding> coming_and_going(const Case& one);
/// Of replies of which some are.
void judge_mixed_frames(const Case& one, std::vector<Finding>& findings);
/// Finds an encoder that was switched on meanwhile: nothing came at first, and from then on every reading was good.
[[nodiscard]] std::optional<Finding> judge_start(const Case& one);
void judge_state(const Case& one, std::vector<Finding>& findings);
void judge_position(const Case& one, const std::vector<Attempted>& readings, bool by_hand,
                    std::vector<Finding>& findings);

/// "1A 20 45", the begin of what is long.
[[nodiscard]] std::string shown(const Attempted& one);

}  // namespace absenc::client
