// SPDX-License-Identifier: Apache-2.0
// Finds evidence in a stream of unsolicited frames: damaged, missing and doubled frames.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/client/doctor/observations.hpp"

namespace absenc::client {

/// Bytes received from a stream, with the times of their arrival.
struct StreamBytes {
  /// A time, and the number of bytes that had arrived by then.
  struct Mark {
    Time at{};
    std::size_t bytes = 0;
  };
  std::vector<std::uint8_t> bytes{};
  std::vector<Mark> marks{};
  // arrival of the last byte of each reading; for a reading without bytes the time of the reading before it, or 0
  std::vector<Time> arrivals{};

  /// Appends the bytes and times of a reading; ignores bytes beyond 1 MiB in total.
  void append(const LineExchange<std::uint8_t>& line);
};

/// Divides the stream at its pauses and returns a reading for each frame between two pauses.
[[nodiscard]] std::vector<Attempted> frames_between_pauses(const Unit& unit, const Options& options,
                                                           const StreamBytes& stream);

/// Inserts a failed reading for each frame that seems to be missing between the readings of a stream.
void insert_missing_frames(std::vector<Attempted>& readings, const std::vector<Time>& arrivals);

/// Returns the number of good frames that arrived twice in a row; 0 if only a few did, or if the frames hardly change.
[[nodiscard]] std::size_t count_doubled(const std::vector<Attempted>& readings, const std::vector<Time>& arrivals);

/// Adds to `seen` the damaged, missing and doubled frames of the stream; may replace `seen.readings`.
void conclude_stream(const Unit& unit, const Options& options, const StreamBytes& stream, Observations& seen);

}  // namespace absenc::client
