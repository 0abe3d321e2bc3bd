// SPDX-License-Identifier: Apache-2.0
// Tells a line that is never silent from one on which something came.
#pragma once

#include "absenc/core/time.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc {

using namespace std::chrono_literals;

/// How long something may go on before the line counts as one that is never silent: long enough for a reply that a
/// carrier breaks into pieces. Slow characters want more.
inline constexpr Time noise_limit = 100ms;

/// What to say about such a line.
inline constexpr Explanation endless_noise{"something sends without a pause", "find the node that does not stop"};

/// Needs no timer: whatever is never silent brings another byte after the limit, and otherwise the silence is told.
class Noise {
 public:
  explicit constexpr Noise(Time limit = noise_limit) : limit_(limit) {}

  /// A new exchange begins.
  constexpr void clear() {
    until_ = never;
    endless_ = false;
  }
  /// Something came, good or damaged.
  constexpr void heard(Time at) {
    if (until_ == never) until_ = at + limit_;
    endless_ = at >= until_;
  }
  /// Whether things still came `limit` after the first one.
  [[nodiscard]] constexpr bool is_endless() const { return endless_; }
  [[nodiscard]] constexpr Explanation explanation() const { return endless_ ? endless_noise : Explanation{}; }

 private:
  Time limit_;
  Time until_ = never;
  bool endless_ = false;
};

}  // namespace absenc
