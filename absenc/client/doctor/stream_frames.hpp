// SPDX-License-Identifier: Apache-2.0
// Evidence of a stream beside its good frames: the bytes of an encoder that sends frames without requests, cut at the
// pauses between them, and the frames that did not come.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/client/doctor/observations.hpp"

namespace absenc::client {

/// The bytes received from a stream, with the times of their arrival.
struct StreamBytes {
  /// A time, and the number of bytes that had arrived by then.
  struct Mark {
    Time at{};
    std::size_t bytes = 0;
  };
  std::vector<std::uint8_t> bytes{};
  std::vector<Mark> marks{};
  std::vector<Time> arrivals{};  // for each reading, the time at which its last byte arrived, or that of the one before

  /// Appends the bytes received during one reading, and its arrival. Leaves out bytes with which there would be more
  /// than 1 MiB.
  void append(const LineExchange<std::uint8_t>& line);
};

/// Returns the pieces of the stream between pauses, without the first and the last one, as replies without a request.
/// The pause that ends a frame is estimated: with it at least half of the pieces are equally long. Returns nothing if
/// there is no such pause.
[[nodiscard]] std::vector<Attempted> frames_between_pauses(const Unit& unit, const Options& options,
                                                           const StreamBytes& stream);

/// Inserts a failed reading (Error::timeout) for each frame that did not come, if the frames come at a regular rate and
/// at least two did not come. `arrivals` are the times at which the frames of `readings` arrived. A gap with damaged
/// frames (Attempted::discarded), or before one of the last two readings, does not count, nor does a late frame.
void insert_missing_frames(std::vector<Attempted>& readings, const std::vector<Time>& arrivals);

/// Returns the number of good frames that arrived twice, directly one after the other, although the position changes; 0
/// if they are fewer than 8 or fewer than 40 % of the readings, or if fewer than 20 % of the frames differ from the one
/// before.
[[nodiscard]] std::size_t count_doubled(const std::vector<Attempted>& readings, const std::vector<Time>& arrivals);

/// Adds to `seen`, which has the readings of a stream, what the bytes of the stream show: damaged frames, frames that
/// came twice, and frames that did not come. If hardly any reading is good, the frames between the pauses replace the
/// readings; if there are none, the last reading gets the first bytes of the stream.
void conclude_stream(const Unit& unit, const Options& options, const StreamBytes& stream, Observations& seen);

}  // namespace absenc::client
