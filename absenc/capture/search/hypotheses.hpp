// SPDX-License-Identifier: Apache-2.0
// Which models and options of a unit explain exchanges that were heard on a line.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "absenc/capture/search/evidence.hpp"

namespace absenc::capture {

/// Each try is paid for: here those before it; by `rank` (client/identify) every unit, setting and encoder that was
/// looked for; in a stream every byte at which a frame might have begun.
struct Hypothesis {
  Options options{};
  Evidence evidence{};
  std::size_t tried = 1;  // hypotheses up to this one, and it: each was a chance to be right by chance
  bool at_least = false;  // the position may have more bits: these are the fewest that explain all

  /// log10 of the probability that one of as many hypotheses is as good by chance.
  [[nodiscard]] double chance() const;
  /// Whether the frames alone say enough: what takes any frame for good may still see all of them move like a position.
  [[nodiscard]] bool is_proven() const;
};

/// From where on, by `Hypothesis::chance`, something is found and not only possible.
inline constexpr double is_found = -3;

/// Whether one goes before the other: what its frames prove before what only moves like a position, as anything does
/// that takes every frame.
[[nodiscard]] inline bool is_likelier(const Hypothesis& one, const Hypothesis& other) {
  if (one.is_proven() != other.is_proven()) return one.is_proven();
  return one.chance() < other.chance();
}

/// All that explain as much as any, the likeliest first; none when nothing is explained. Models are tried before single
/// options. `settings` hold for all, as the address of the encoder that was asked.
[[nodiscard]] std::vector<Hypothesis> find_hypotheses(const Unit& unit, std::span<const OptionText> settings,
                                                      std::span<const ObservedExchange> exchanges);

/// The options that change how many bits a position has, by index.
[[nodiscard]] std::vector<std::size_t> resolution_options(const Unit& unit);

/// Every model with these settings, then the unit's defaults, which know none; without those that refuse them.
[[nodiscard]] std::vector<Options> likely_options(const Unit& unit, std::span<const OptionText> settings);

}  // namespace absenc::capture
