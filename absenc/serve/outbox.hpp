// SPDX-License-Identifier: Apache-2.0
// Good readings on their way to other systems: each encoder keeps them until they are fetched.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "absenc/client/estimate.hpp"

namespace absenc::serve {

/// One good reading. What does not hold is not there.
struct OutgoingReading {
  std::int64_t at_us = 0;                         // calendar, of when it was latched
  std::optional<double> place{};                  // past the end of a turn: degrees, of linear encoders mm
  std::optional<client::Estimate> speed{};        // rpm, of linear encoders mm/s
  std::optional<double> joint{};                  // degrees, of linear encoders mm; where the settings say how it sits
  std::optional<client::Estimate> joint_speed{};  // rpm, of linear encoders mm/s
  std::optional<double> electrical_deg{};
  std::optional<std::uint64_t> counts{};
  std::optional<std::int64_t> turns{};
};

/// Bounded: whoever fetches too seldom loses the oldest, which are counted. Empty until somebody fetches.
class Outbox {
 public:
  static constexpr std::size_t most = 2048;

  struct Taken {
    std::vector<OutgoingReading> readings{};  // the oldest first
    std::uint64_t dropped = 0;                // before them
  };

  [[nodiscard]] bool wanted() const { return wanted_; }

  void put(const OutgoingReading& reading) {
    waiting_.push_back(reading);
    if (waiting_.size() <= most) return;
    waiting_.pop_front();
    ++dropped_;
  }

  [[nodiscard]] Taken take() {
    wanted_ = true;
    Taken taken{{waiting_.begin(), waiting_.end()}, dropped_};
    waiting_.clear();
    dropped_ = 0;
    return taken;
  }

  void close() { *this = {}; }

 private:
  std::deque<OutgoingReading> waiting_;
  std::uint64_t dropped_ = 0;
  bool wanted_ = false;
};

}  // namespace absenc::serve
