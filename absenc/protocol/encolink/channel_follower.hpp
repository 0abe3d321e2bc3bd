// SPDX-License-Identifier: Apache-2.0
// Channels 2 and 3 in a capture: the cycles that position frames carry a byte each, and the register accesses whose
// requests ride in `ra` and whose answers ride in those cycles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/bytes.hpp"
#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/encolink/registers.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

/// A cycle begins with the frame behind a reset of the channels (AA, BB). Where none was seen, as in a capture of an
/// encoder that has long been running, one is found by its checksum and by the position, which is that of the frame
/// with which it began.
class ChannelFollower final : public Follower {
 public:
  explicit ChannelFollower(const Format& format) : format_(format) {}

  void follow(std::uint64_t number, Bytes request, Bytes reply) override;
  void lose() override;
  bool take(Composed& one) override;

 private:
  static constexpr std::size_t longest_cycle = Format{.multiturn_bits = 16}.cycle_bytes();

  void reset();
  void take_byte(const Format& format, std::uint64_t number, const Position& position);
  void take_answer(std::uint8_t byte);
  void take_request(std::uint64_t number, std::uint8_t byte);

  Format format_;
  // Channel 2. Its byte in each of the last frames, and the position of the oldest of them.
  bool in_step_ = false;
  Buffer<Position, longest_cycle> frames_;
  std::uint64_t first_ = 0;  // number of the oldest
  std::optional<Composed> cycle_;
  ByteBuffer<longest_cycle> cycle_bytes_;
  // Channel 3.
  AccessBytes asking_;  // `ra` bytes so far
  std::uint64_t asking_from_ = 0;
  AccessBytes asked_;  // the last whole access
  std::uint64_t asked_from_ = 0;
  bool awaits_answer_ = false;
  ByteBuffer<2 + access_capacity> answer_;
  bool has_answer_ = false;  // it ended with the last exchange
};

}  // namespace absenc::encolink
