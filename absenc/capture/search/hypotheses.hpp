// SPDX-License-Identifier: Apache-2.0
// Finds the models and options of a unit that explain the exchanges on a line.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "absenc/capture/search/evidence.hpp"

namespace absenc::capture {

/// Option values that explain exchanges, with the evidence for them.
struct Hypothesis {
  Options options{};
  Evidence evidence{};
  std::size_t tried = 1;  // number of hypotheses that were tried, including this one: each may match by chance
  // true: the encoder may have more position or turns bits than `options` state, because frames do not show it
  bool at_least = false;

  /// Returns log10 of the probability that at least one of `tried` hypotheses fits this well by chance.
  [[nodiscard]] double chance() const;
  /// Returns whether the good frames alone, without the motion of the position, prove the options of this hypothesis.
  [[nodiscard]] bool is_proven() const;
};

/// Limit of `Hypothesis::chance`: a hypothesis at or below it counts as found, one above it only as possible.
inline constexpr double is_found = -3;

/// Returns whether `one` is ranked before `other`: proven hypotheses come first, then those with the smaller chance of
/// being an accident.
[[nodiscard]] inline bool is_likelier(const Hypothesis& one, const Hypothesis& other) {
  if (one.is_proven() != other.is_proven()) return one.is_proven();
  return one.chance() < other.chance();
}

/// Returns hypotheses that explain the most exchanges, the likeliest first. The search starts from options with
/// `settings`, and tries other values of these options, too.
[[nodiscard]] std::vector<Hypothesis> find_hypotheses(const Unit& unit, std::span<const OptionText> settings,
                                                      std::span<const ObservedExchange> exchanges);

/// Returns the indices of the options that are numbers of bits and change the resolution.
[[nodiscard]] std::vector<std::size_t> resolution_options(const Unit& unit);

/// Returns options to try first: those of models, then the defaults, with `settings` applied.
[[nodiscard]] std::vector<Options> likely_options(const Unit& unit, std::span<const OptionText> settings);

}  // namespace absenc::capture
