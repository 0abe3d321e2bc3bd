// SPDX-License-Identifier: Apache-2.0
// Reduces the number of cases of a long test in builds where each case is slow.
#pragma once

#include <algorithm>
#include <cstdlib>

namespace absenc {

/// Returns the part of `all` cases that the environment variable ABSENC_CASES_PERCENT states in percent (default
/// 100), at least 1. Use it only for numbers of cases that are alike.
inline unsigned test_cases(unsigned all) {
  const char* const percent = std::getenv("ABSENC_CASES_PERCENT");
  if (percent == nullptr) return all;
  return std::max(
      1u, static_cast<unsigned>(static_cast<unsigned long long>(all) * std::strtoul(percent, nullptr, 10) / 100));
}

}  // namespace absenc
