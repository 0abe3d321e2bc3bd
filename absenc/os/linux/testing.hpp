// SPDX-License-Identifier: Apache-2.0
// Helpers for tests on pseudo-terminals and other descriptors.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <string>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/testing.hpp"

namespace absenc::os::testing {

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

}  // namespace absenc::os::testing
