// SPDX-License-Identifier: Apache-2.0
// Requests that come while a virtual encoder sends: each is one broken rule, not each of its bytes.
#pragma once

#include <cstddef>
#include <optional>

#include "absenc/core/time.hpp"

namespace absenc {

/// A bus that is held by another sender while a request runs.
class Interruption {
 public:
  /// The encoder begins to send.
  void begin() {
    heard_at_.reset();
    due_ = 0;
  }
  /// Whether the byte that came at `at` begins a request. `length`: of the request that such a byte begins, 0: of none
  /// (on a line that both use, what collides is garbled). What follows a pause of two characters begins one.
  bool begins_request(std::size_t length, Time at, Time character) {
    const bool begins_run = !heard_at_ || at - *heard_at_ > 2 * character;
    heard_at_ = at;
    if (!begins_run && due_ > 0) {
      --due_;
      return false;
    }
    due_ = length > 0 ? length - 1 : 0;
    return begins_run || length > 0;
  }

 private:
  std::optional<Time> heard_at_{};
  std::size_t due_ = 0;
};

}  // namespace absenc
