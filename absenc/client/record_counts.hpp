// SPDX-License-Identifier: Apache-2.0
// Counts of the rows of a recording.
#pragma once

#include <cstdint>

namespace absenc::client {

/// How many readings a recording has, and how many are missing.
struct RecordCounts {
  std::uint64_t readings = 0;  ///< Number of readings.
  std::uint64_t failures = 0;  ///< Number of failed attempts to read.
  std::uint64_t gaps = 0;      ///< Number of gaps, in which readings were due and not taken.
  std::uint64_t missed = 0;    ///< Number of readings that were due in the gaps.

  /// Adds the counts of another recording.
  RecordCounts& operator+=(const RecordCounts& other) {
    readings += other.readings;
    failures += other.failures;
    gaps += other.gaps;
    missed += other.missed;
    return *this;
  }
};

}  // namespace absenc::client
