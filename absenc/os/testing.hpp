// SPDX-License-Identifier: Apache-2.0
// Helpers for tests that use this folder.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "absenc/core/bytes.hpp"
#include "absenc/link/step.hpp"
#include "absenc/os/error.hpp"

namespace absenc::os::testing {

using Data = std::vector<std::uint8_t>;

[[nodiscard]] inline Data data(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

[[nodiscard]] inline ByteStep transfer(Bytes out, Time at = {}) {
  return {.kind = ByteStep::Kind::transfer, .out = out, .at = at};
}

/// A temporary directory, removed at the end.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::random_device random;
    do path_ = std::filesystem::temp_directory_path() / ("absenc-os-" + std::to_string(random()));
    while (!std::filesystem::create_directory(path_));
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  ~TemporaryDirectory() { std::filesystem::remove_all(path_); }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Returns the Failure that `action` throws; the test fails if it throws none.
[[nodiscard]] inline Failure failure_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Failure& failure) {
    return failure;
  }
  ADD_FAILURE() << "no Failure was thrown";
  return {Failure::Kind::system, "none"};
}

}  // namespace absenc::os::testing
