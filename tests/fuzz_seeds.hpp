// SPDX-License-Identifier: Apache-2.0
// Provides the first inputs ("seeds") of every fuzz target: the test vectors of all units.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/core/bytes.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc {

using Seed = std::vector<std::uint8_t>;

/// Returns seeds for fuzzers, made from the test vectors of all units.
inline std::vector<Seed> fuzz_seeds() {
  std::vector<Seed> seeds;
  std::uint8_t number = 0;
  for (const Unit* unit : all_units()) {
    std::uint8_t command = 0;
    for (const Vector& vector : unit->vectors) {
      Seed both(vector.request.begin(), vector.request.end());
      both.insert(both.end(), vector.reply.begin(), vector.reply.end());
      seeds.emplace_back(vector.request.begin(), vector.request.end());
      seeds.emplace_back(vector.reply.begin(), vector.reply.end());
      seeds.push_back(both);
      both.insert(both.begin(), {number, 0, command++});
      seeds.push_back(both);
    }
    ++number;
  }
  return seeds;
}

}  // namespace absenc
