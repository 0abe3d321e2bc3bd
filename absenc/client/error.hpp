// SPDX-License-Identifier: Apache-2.0
// What the client library throws beside os::Failure, of a port, and os::Interrupted.
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

/// Another thread asked for it, or its time is over.
using Cancelled = os::Ended;

}  // namespace absenc::client
