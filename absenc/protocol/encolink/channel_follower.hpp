// SPDX-License-Identifier: Apache-2.0
// Finds cycles of channel 2 and register accesses of channel 3 in a capture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/bytes.hpp"
#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/encolink/registers.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

/// Combines captured frames to cycles of channel 2 and to register accesses.
class ChannelFollower final : public Follower {
 public:
  /// Creates a follower for encoders with this format.
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
  // The next members are the state of channel 2.
  bool in_step_ = false;
  Buffer<Position, longest_cycle> frames_;
  std::uint64_t first_ = 0;  // number of the exchange that has the oldest frame in `frames_`
  std::optional<Composed> cycle_;
  ByteBuffer<longest_cycle> cycle_bytes_;
  // The next members are the state of channel 3.
  AccessBytes partial_access_;  // second bytes (`ra`) of the requests of a register access that is not complete yet
  std::uint64_t partial_access_from_ = 0;
  AccessBytes last_access_;  // second bytes (`ra`) of the requests of the last complete register access
  std::uint64_t last_access_from_ = 0;
  bool awaits_answer_ = false;
  ByteBuffer<2 + access_capacity> answer_;
  // whether the last exchange completed the encoder's answer to the last complete register access
  bool has_answer_ = false;
};

}  // namespace absenc::encolink
