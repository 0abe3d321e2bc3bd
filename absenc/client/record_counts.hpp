// SPDX-License-Identifier: Apache-2.0
// What the rows of a recording are, counted.
#pragma once

#include <cstdint>

namespace absenc::client {

struct RecordCounts {
  std::uint64_t readings = 0;
  std::uint64_t failures = 0;  ///< attempts to read
  std::uint64_t gaps = 0;
  std::uint64_t missed = 0;  ///< readings, in these gaps

  RecordCounts& operator+=(const RecordCounts& other) {
    readings += other.readings;
    failures += other.failures;
    gaps += other.gaps;
    missed += other.missed;
    return *this;
  }
};

}  // namespace absenc::client
