// SPDX-License-Identifier: Apache-2.0
// A share, counted in a sample, with its confidence interval.
#pragma once

#include <cstdint>

namespace absenc::client {

/// A number of hits among a number of tries.
struct Share {
  std::uint64_t count = 0;  ///< Number of hits.
  std::uint64_t of = 0;     ///< Number of tries.

  /// Returns the share of hits, 0 to 1; 0 if there were no tries.
  [[nodiscard]] double rate() const { return of == 0 ? 0 : static_cast<double>(count) / static_cast<double>(of); }
  /// Returns the lower end of Wilson's score interval at 95 % confidence, 0 to 1.
  [[nodiscard]] double low() const;
  /// Returns the upper end of Wilson's score interval at 95 % confidence, 0 to 1.
  [[nodiscard]] double high() const;
};

}  // namespace absenc::client
