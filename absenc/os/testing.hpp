// SPDX-License-Identifier: Apache-2.0
// Helpers for tests that use this folder.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "absenc/core/bytes.hpp"
#include "absenc/link/step.hpp"
#include "absenc/os/descriptor.hpp"
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
    std::string name = std::filesystem::temp_directory_path() / "absenc-os-XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) throw system_failure("mkdtemp", errno);
    path_ = name;
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  ~TemporaryDirectory() { std::filesystem::remove_all(path_); }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// A pseudo-terminal with its open master and the path of its slave.
struct PseudoTerminal {
  PseudoTerminal() : master(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    ::grantpt(master.get());
    ::unlockpt(master.get());
    std::array<char, 64> name{};
    ::ptsname_r(master.get(), name.data(), name.size());
    path = name.data();
  }
  Descriptor master;
  std::string path;
};

inline void put(int descriptor, const Data& bytes) {
  ASSERT_EQ(::write(descriptor, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
}

/// Returns the bytes of one read from `descriptor`; empty if nothing is received within `milliseconds`.
[[nodiscard]] inline Data get(int descriptor, int milliseconds = 5000) {
  pollfd readable{descriptor, POLLIN, 0};
  if (::poll(&readable, 1, milliseconds) <= 0) return {};
  Data bytes(4096);
  const ssize_t size = ::read(descriptor, bytes.data(), bytes.size());
  bytes.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return bytes;
}

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
