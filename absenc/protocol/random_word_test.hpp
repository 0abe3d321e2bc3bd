// SPDX-License-Identifier: Apache-2.0
// Random word formats, for tests that compare two ways of decoding.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "absenc/protocol/word_format.hpp"
#include "absenc/sim/random.hpp"

namespace absenc {

/// Returns a format with a position, and possibly other fields, in any order, of at most 115 bits.
inline WordFormat random_word(sim::Random& random) {
  std::vector<Meaning> meanings{Meaning::position};
  for (const Meaning one : {Meaning::multiturn, Meaning::error, Meaning::warning, Meaning::parity}) {
    if (random.below(2) != 0) meanings.push_back(one);
  }
  for (std::uint64_t i = random.below(5); i > 0; --i) {
    meanings.push_back(random.below(2) != 0 ? Meaning::value : Meaning::skip);
  }
  for (std::size_t i = meanings.size() - 1; i > 0; --i) std::swap(meanings[i], meanings[random.below(i + 1)]);

  WordFormat format;
  unsigned counting = 64;  // number of bits, of 64, that position and turns have not used yet
  for (std::size_t i = 0; i < meanings.size(); ++i) {
    const bool counts = meanings[i] == Meaning::position || meanings[i] == Meaning::multiturn;
    const bool flag = meanings[i] >= Meaning::error && meanings[i] <= Meaning::parity;
    const unsigned most = counts ? std::clamp(counting - 1, 1u, random.below(4) == 0 ? 63u : 30u) : 12u;
    const auto bits = static_cast<unsigned>(flag ? 1 : 1 + random.below(most));
    if (counts) counting -= bits;
    const std::string name = "f" + std::to_string(i);
    format.add({std::string_view(name), meanings[i], static_cast<std::uint8_t>(bits), random.below(2) != 0});
  }
  if (random.below(3) == 0) format.set_gray();
  return format;
}

}  // namespace absenc
