// SPDX-License-Identifier: Apache-2.0
// Counts of readings and failures in a recording.
#pragma once

#include <cstdint>

namespace absenc::client {

/// How many readings a recording has, and how many are missing.
struct RecordCounts {
  std::uint64_t readings = 0;  ///< Number of good readings.
  std::uint64_t failures = 0;  ///< Number of failed attempts to read.
  std::uint64_t gaps = 0;      ///< Number of gaps, in which readings were due and not taken.
  std::uint64_t missed = 0;    ///< Number of readings that were due and not taken, in all gaps together.

  /// Adds the counts of `other` and returns the sum.
  RecordCounts& operator+=(const RecordCounts& other) {
    readings += other.readings;
    failures += other.failures;
    gaps += other.gaps;
    missed += other.missed;
    return *this;
  }
};

}  // namespace absenc::client
