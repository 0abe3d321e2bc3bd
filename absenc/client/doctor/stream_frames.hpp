// SPDX-License-Identifier: Apache-2.0
// Cuts what an encoder sent by itself into frames by its pauses, so that damaged frames and missing ones can be judged
// like replies.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/client/doctor/observations.hpp"

namespace absenc::client {

/// The bytes of a stream, and when they arrived.
struct StreamBytes {
  /// When all bytes up to `end` were there.
  struct Mark {
    Time at{};
    std::size_t end = 0;
  };
  std::vector<std::uint8_t> bytes{};
  std::vector<Mark> marks{};
};

/// Returns each frame, good or damaged, in the order of time. Where the frames come at even distances, one that did not
/// come is among them, with Error::timeout. Nothing where the pauses do not show where a frame ends: a stream without
/// pauses, or too few frames.
[[nodiscard]] std::vector<Attempted> stream_frames(const Unit& unit, const Options& options, const StreamBytes& stream);

/// Returns how many of the bytes belong to good frames between other bytes, which are most of them: somebody else
/// sends, too. 0: it is not so, or chance makes as many good frames of other bytes.
[[nodiscard]] std::size_t bytes_among_others(const Unit& unit, const Options& options, const StreamBytes& stream);

}  // namespace absenc::client
