// SPDX-License-Identifier: Apache-2.0
// Exceptions of the client library; a port throws os::Failure and os::Interrupted. All are std::exceptions.
#pragma once

#include <stdexcept>

#include "absenc/os/error.hpp"

namespace absenc::client {

/// The caller requested something impossible. The text is a sentence with the wrong value and its place.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The content of a file or a well-formed reply is not as expected. The text is a sentence.
struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Another thread or a callback cancelled the operation.
using Cancelled = os::Ended;

/// The operation reached the caller's deadline.
struct DeadlinePassed : Cancelled {
  /// Returns what happened.
  [[nodiscard]] const char* what() const noexcept override { return "the deadline passed before there was a reading"; }
};

}  // namespace absenc::client
