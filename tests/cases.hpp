// SPDX-License-Identifier: Apache-2.0
// How many cases a long test takes: all, or where each of them takes many times as long, a share.
#pragma once

#include <algorithm>
#include <cstdlib>

namespace absenc {

/// `all` times the percentage in ABSENC_CASES_PERCENT (0 to 100; without it all), at least 1. Only for counts of cases
/// that are alike: what a test must see of each kind is no matter of their number.
inline unsigned test_cases(unsigned all) {
  const char* const percent = std::getenv("ABSENC_CASES_PERCENT");
  if (percent == nullptr) return all;
  return std::max(
      1u, static_cast<unsigned>(static_cast<unsigned long long>(all) * std::strtoul(percent, nullptr, 10) / 100));
}

}  // namespace absenc
