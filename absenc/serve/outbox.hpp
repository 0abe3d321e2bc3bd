// SPDX-License-Identifier: Apache-2.0
// Bounded queues of an encoder's good readings, from which they are sent to other systems.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "absenc/client/estimate.hpp"

namespace absenc::serve {

/// A good reading that is sent to other systems. Members without a valid value are empty.
struct OutgoingReading {
  std::int64_t at_us = 0;         // calendar time at which the encoder latched the position
  std::optional<double> place{};  // position that continues past the end of a turn; degrees, for linear encoders mm
  std::optional<client::Estimate> speed{};        // speed of the encoder; rpm, for linear encoders mm/s
  std::optional<double> joint{};                  // position of the joint, if the settings describe it; degrees or mm
  std::optional<client::Estimate> joint_speed{};  // speed of the joint; rpm, for linear encoders mm/s
  std::optional<double> electrical_deg{};
  std::optional<std::uint64_t> counts{};
  std::optional<std::int64_t> turns{};
};

/// A bounded queue of readings; when it is full, it drops the oldest reading. `put` may be called only while `wanted`
/// returns true.
class Outbox {
 public:
  static constexpr std::size_t most = 2048;

  struct Taken {
    std::vector<OutgoingReading> readings{};  // the taken readings, oldest first
    std::uint64_t dropped = 0;                // number of readings that were dropped since the last `take`
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
