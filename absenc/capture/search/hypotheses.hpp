// SPDX-License-Identifier: Apache-2.0
// Finds the models and options of a unit that explain the exchanges on a line.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "absenc/capture/search/evidence.hpp"

namespace absenc::capture {

/// Options that explain exchanges, with their evidence. Every attempt raises the chance of a false match. Here the
/// attempts are those of one search; `rank` (client/identify) multiplies them by the number of searches.
struct Hypothesis {
  Options options{};
  Evidence evidence{};
  std::size_t tried = 1;  // number of attempts, including this one, each of which may match by chance
  bool at_least = false;  // the position may have more bits than `options` state

  /// Returns log10 of the probability that one of `tried` hypotheses is as good as this one by chance.
  [[nodiscard]] double chance() const;
  /// Returns whether the evidence of the frames suffices (`is_found`), without that of the motion of the position.
  [[nodiscard]] bool is_proven() const;
};

/// Limit of `Hypothesis::chance`: a result at or below it is reported as found, a result above it only as possible.
inline constexpr double is_found = -3;

/// Returns whether the hypothesis `one` is ranked before `other`: hypotheses proven by their frames come first, then
/// those with the smaller chance.
[[nodiscard]] inline bool is_likelier(const Hypothesis& one, const Hypothesis& other) {
  if (one.is_proven() != other.is_proven()) return one.is_proven();
  return one.chance() < other.chance();
}

/// Returns hypotheses that explain the most exchanges, the likeliest first; none if no exchange is explained. The
/// search starts from options with `settings` applied, for example the address of the polled encoder, and may change
/// them.
[[nodiscard]] std::vector<Hypothesis> find_hypotheses(const Unit& unit, std::span<const OptionText> settings,
                                                      std::span<const ObservedExchange> exchanges);

/// Returns the indices of those numeric options, with a maximum of 64 or less, that change the number of bits of
/// position or turns.
[[nodiscard]] std::vector<std::size_t> resolution_options(const Unit& unit);

/// Returns the options of every model with the given settings, then the unit's defaults with the settings, without a
/// model, unless a model has the same values. Options that contradict the settings are left out.
[[nodiscard]] std::vector<Options> likely_options(const Unit& unit, std::span<const OptionText> settings);

}  // namespace absenc::capture
