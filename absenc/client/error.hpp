// SPDX-License-Identifier: Apache-2.0
// Exceptions of the client library; a port throws os::Failure and os::Interrupted. All are std::exceptions.
#pragma once

#include <stdexcept>

#include "absenc/os/error.hpp"

namespace absenc::client {

/// The caller asked for something that cannot be: a sentence that names what and where.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A file, or an encoder that answered well, is not what was expected: a sentence.
struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Another thread asked for it.
using Cancelled = os::Ended;

/// The deadline of the caller has come.
struct DeadlinePassed : Cancelled {
  /// Returns what happened.
  [[nodiscard]] const char* what() const noexcept override { return "the deadline passed before there was a reading"; }
};

}  // namespace absenc::client
