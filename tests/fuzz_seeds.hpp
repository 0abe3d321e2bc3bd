// SPDX-License-Identifier: Apache-2.0
// What every fuzz body is fed first: the vectors of all units.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/core/bytes.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc {

using Seed = std::vector<std::uint8_t>;

/// Request, reply and both in a row, of every vector.
inline std::vector<Seed> fuzz_seeds() {
  std::vector<Seed> seeds;
  for (const Unit* unit : all_units()) {
    for (const Vector& vector : unit->vectors) {
      Seed both(vector.request.begin(), vector.request.end());
      both.insert(both.end(), vector.reply.begin(), vector.reply.end());
      seeds.emplace_back(vector.request.begin(), vector.request.end());
      seeds.emplace_back(vector.reply.begin(), vector.reply.end());
      seeds.push_back(both);
    }
  }
  return seeds;
}

}  // namespace absenc
