// SPDX-License-Identifier: Apache-2.0
// Exceptions of the client library. Ports also throw os::Failure and os::Interrupted.
#pragma once

#include <stdexcept>

#include "absenc/os/error.hpp"

namespace absenc::client {

/// Exception: the caller requested something impossible. The text says what is wrong.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Exception: an operation cannot be completed. The text states the problem.
struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Exception: another thread or a callback cancelled the operation.
using Cancelled = os::Ended;

/// Exception: the operation did not end before the caller's deadline.
struct DeadlinePassed : Cancelled {
  /// Returns a sentence about the deadline.
  [[nodiscard]] const char* what() const noexcept override { return "the deadline passed before there was a reading"; }
};

}  // namespace absenc::client
