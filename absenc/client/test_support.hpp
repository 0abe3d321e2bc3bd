// SPDX-License-Identifier: Apache-2.0
// Helpers that the tests of the client library share.
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <string_view>

namespace absenc::client {

/// Returns a path for a temporary file that no other test uses.
inline std::string own_path(std::string_view what) {
  return testing::TempDir() + "absenc-client-" + std::string(what) + std::to_string(std::random_device{}());
}

template <class Thrown, class Work>
std::string thrown_by(const Work& work) {
  try {
    work();
  } catch (const Thrown& thrown) {
    return thrown.what();
  }
  return "nothing was thrown";
}

}  // namespace absenc::client
