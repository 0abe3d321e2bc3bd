// SPDX-License-Identifier: Apache-2.0
// Finds where requests begin among the bytes that a virtual encoder receives while it sends.
#pragma once

#include <cstddef>
#include <optional>

#include "absenc/core/time.hpp"

namespace absenc {

/// Splits the bytes received during one transmission of a virtual encoder into requests.
class Interruption {
 public:
  /// Notes that the encoder begins to send.
  void begin() {
    received_at_.reset();
    due_ = 0;
  }
  /// Returns whether the byte received at `at` is the first byte of a request, or the first byte after the call of
  /// `begin` or after a pause. `length`: length of a request that begins with this byte, or 0; `character`: duration of
  /// a character.
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
