// SPDX-License-Identifier: Apache-2.0
// Finds the models and options of a unit that explain exchanges on a line.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "absenc/capture/search/evidence.hpp"

namespace absenc::capture {

/// Options that explain exchanges, with their evidence. Every attempt raises the chance of a false match: here the
/// number of attempts before, in `rank` (client/identify) every unit, setting and encoder tried, in a stream every byte
/// at which a frame might begin.
struct Hypothesis {
  Options options{};
  Evidence evidence{};
  std::size_t tried = 1;  // number of hypotheses up to and including this one, each with its own chance
  bool at_least = false;  // the position may have more bits: these are the fewest that explain all

  /// Returns log10 of the probability that one of `tried` hypotheses is as good by chance.
  [[nodiscard]] double chance() const;
  /// Returns whether the frames alone suffice: a unit that accepts any frame may still see positions that move
  /// plausibly.
  [[nodiscard]] bool is_proven() const;
};

/// Limit of `Hypothesis::chance` below which a result counts as found, not only as possible.
inline constexpr double is_found = -3;

/// Returns whether `one` is ranked before `other`: hypotheses proven by their frames come before those that are only
/// supported by the motion of the position.
[[nodiscard]] inline bool is_likelier(const Hypothesis& one, const Hypothesis& other) {
  if (one.is_proven() != other.is_proven()) return one.is_proven();
  return one.chance() < other.chance();
}

/// Returns all hypotheses that explain the most exchanges, the likeliest first; none if nothing is explained. Models
/// are tried before single options. `settings` apply to all, for example the address of the polled encoder.
[[nodiscard]] std::vector<Hypothesis> find_hypotheses(const Unit& unit, std::span<const OptionText> settings,
                                                      std::span<const ObservedExchange> exchanges);

/// Returns the indices of the options that change the number of bits of a position.
[[nodiscard]] std::vector<std::size_t> resolution_options(const Unit& unit);

/// Returns the options of every model with these settings, then the unit's defaults without a model; those that refuse
/// the settings are left out.
[[nodiscard]] std::vector<Options> likely_options(const Unit& unit, std::span<const OptionText> settings);

}  // namespace absenc::capture
