// SPDX-License-Identifier: Apache-2.0
// Estimates how strongly exchanges are evidence for a protocol.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::capture {

/// A frame that owns its bytes.
struct ObservedFrame {
  std::vector<std::uint8_t> bytes{};
  std::size_t bits = 0;  // number of bits of the frame on clocked links; otherwise 0
  std::optional<CanFrame> can{};

  /// Returns a view of this frame, which is valid as long as this object exists.
  [[nodiscard]] Frame frame() const { return {bytes, bits, can ? &*can : nullptr}; }
  friend bool operator==(const ObservedFrame&, const ObservedFrame&) = default;
};

/// A request and its reply; one of them may be empty.
struct ObservedExchange {
  ObservedFrame request{};
  ObservedFrame reply{};

  friend bool operator==(const ObservedExchange&, const ObservedExchange&) = default;
};

/// How strongly captured exchanges prove that an encoder uses a protocol.
struct Evidence {
  std::size_t tried = 0;      // number of captured exchanges that were examined
  std::size_t explained = 0;  // number of exchanges with a good reply
  // number of good exchanges that differ from each other, because a repeated one proves no more
  std::size_t distinct = 0;
  /// log10 of the probability that the unit would accept at least as many replies as good if the replies were random.
  double frames = 0;
  /// log10 of the chance that random positions move as little as those in the exchanges; empty: no position changed
  std::optional<double> motion{};

  /// Returns log10 of the chance of an accident: that random frames are accepted as good and, if every exchange is
  /// explained, that random positions move as little as those read.
  [[nodiscard]] double chance() const;
  [[nodiscard]] bool explains_all() const { return tried != 0 && explained == tried; }
};

/// Limit of log10 of the chance of an accident: at or below it the good frames alone, without the motion of the
/// position, prove the options of an encoder.
inline constexpr double frames_suffice = -2;

/// Usual limit for the number of random replies tried for a frame.
inline constexpr unsigned usual_attempts = 1u << 14;

/// Estimates the probability that the unit accepts a random reply like `good.reply`, at least 1 / `attempts`. Bytes at
/// the beginning of the reply that repeat the request are not random.
[[nodiscard]] double acceptance(const Unit& unit, const Options& options, const ObservedExchange& good,
                                unsigned attempts = usual_attempts);

/// Returns whether the unit, with these options, accepts the reply of `exchange` as good.
[[nodiscard]] bool explains(const Unit& unit, const Options& options, const ObservedExchange& exchange);

/// Returns the evidence of exchanges, which must be in the order of time.
[[nodiscard]] Evidence weigh(const Unit& unit, const Options& options, std::span<const ObservedExchange> exchanges);

/// Returns log10 of the chance of at least `good` of `all` events of probability `each`.
[[nodiscard]] double tail(std::size_t good, std::size_t all, double each);

}  // namespace absenc::capture
