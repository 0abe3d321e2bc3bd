// SPDX-License-Identifier: Apache-2.0
// How much exchanges on a line say for a protocol: how many it explains, and how likely chance would explain as many.
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
  std::size_t bits = 0;  // clocked links
  std::optional<CanFrame> can{};

  /// Valid as long as this object.
  [[nodiscard]] Frame frame() const { return {bytes, bits, can ? &*can : nullptr}; }
  friend bool operator==(const ObservedFrame&, const ObservedFrame&) = default;
};

/// A request and what came back; without a request, nobody had asked or it is not known what.
struct ObservedExchange {
  ObservedFrame request{};
  ObservedFrame reply{};

  friend bool operator==(const ObservedExchange&, const ObservedExchange&) = default;
};

/// What repeats of the request is no evidence, nor is a reply that comes again.
struct Evidence {
  std::size_t tried = 0;      // exchanges
  std::size_t explained = 0;  // of them: the reply is good
  std::size_t distinct = 0;   // of these: that differ, because a frame that comes again proves nothing more
  /// log10 of the probability that chance explains as many.
  double frames = 0;
  /// The same of positions that change as little from one to the next; empty: none changed.
  std::optional<double> motion{};

  /// What there is against chance: the frames, and how the position moves, which a wrong protocol sees as well.
  [[nodiscard]] double chance() const;
  [[nodiscard]] bool explains_all() const { return tried != 0 && explained == tried; }
};

/// From where on frames say enough by themselves.
inline constexpr double frames_say_enough = -2;

/// What random content is tried: enough where there are several frames, whose chances multiply.
inline constexpr unsigned usual_attempts = 1u << 14;

/// How often the unit takes random content for a good reply of this length to this request: at most 1, at least one in
/// the number of attempts. What the reply repeats of the request from its beginning on stays as it is.
[[nodiscard]] double acceptance(const Unit& unit, const Options& options, const ObservedExchange& good,
                                unsigned attempts = usual_attempts);

/// Whether the unit takes this reply for a good one.
[[nodiscard]] bool explains(const Unit& unit, const Options& options, const ObservedExchange& exchange);

/// Exchanges in the order of time.
[[nodiscard]] Evidence weigh(const Unit& unit, const Options& options, std::span<const ObservedExchange> exchanges);

/// log10 of the probability that at least `good` of `all` come about when each does with the probability `each`.
[[nodiscard]] double tail(std::size_t good, std::size_t all, double each);

}  // namespace absenc::capture
