// SPDX-License-Identifier: Apache-2.0
// Cuts the stream of an encoder that sends by itself into frames by its pauses, so that damaged and missing frames can
// be judged like replies.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/client/doctor/observations.hpp"

namespace absenc::client {

/// The bytes of a stream with their arrival times.
struct StreamBytes {
  /// The time at which all bytes up to index `end` had arrived.
  struct Arrival {
    Time at{};
    std::size_t end = 0;
  };
  std::vector<std::uint8_t> bytes{};
  std::vector<Arrival> marks{};
};

/// Returns each frame, good or damaged, in order. If the frames are periodic, a missing one is included with
/// Error::timeout. Returns nothing if pauses do not separate the frames, or if there are too few frames.
[[nodiscard]] std::vector<Attempted> stream_frames(const Unit& unit, const Options& options, const StreamBytes& stream);

/// Returns the number of bytes that belong to good frames if most bytes do not, because another device sends too; 0
/// otherwise, or if chance would make as many good frames of random bytes.
[[nodiscard]] std::size_t bytes_among_others(const Unit& unit, const Options& options, const StreamBytes& stream);

}  // namespace absenc::client
