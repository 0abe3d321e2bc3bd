// SPDX-License-Identifier: Apache-2.0
// Requests received while a virtual encoder sends: each request counts once, not each of its bytes.
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
    received_at_.reset();
    due_ = 0;
  }
  /// Returns whether the byte received at `at` begins a request. `length`: length of a request that begins with this
  /// byte, 0 if none does (a collision on a half-duplex line garbles bytes). A byte after a pause of two characters
  /// always begins one.
  bool begins_request(std::size_t length, Time at, Time character) {
    const bool begins_run = !received_at_ || at - *received_at_ > 2 * character;
    received_at_ = at;
    if (!begins_run && due_ > 0) {
      --due_;
      return false;
    }
    due_ = length > 0 ? length - 1 : 0;
    return begins_run || length > 0;
  }

 private:
  std::optional<Time> received_at_{};
  std::size_t due_ = 0;
};

}  // namespace absenc
