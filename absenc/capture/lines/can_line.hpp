// SPDX-License-Identifier: Apache-2.0
// Decodes classic CAN frames from the level changes of a bus (ISO 11898-1): recessive is high.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Returns the meaning of an error frame, as words without a full stop.
[[nodiscard]] std::string_view text_of_error(const CanFrame& error);

/// A decoder of CAN frames, which decodes a capture part by part. A violation of the protocol is reported as an error
/// frame like those of the kernel (linux/can/error.h).
class CanDecoder {
 public:
  /// `bit` is the bit time in ticks, at least 3; it need not be a whole number.
  explicit CanDecoder(double bit) : bit_(bit) {}

  /// Decodes the next part of the capture, from tick `first` to `end`, and appends its frames.
  void decode(const Changes& part, Tick first, Tick end, std::vector<CanRecord>& frames);
  /// Ends the capture; a frame that is cut off by the end is no error.
  void finish(std::vector<CanRecord>& frames);

 private:
  enum class State : std::uint8_t { waiting, idle, stuffed, tail };

  void change(Tick at, std::vector<CanRecord>& frames);
  void level_for(bool level, Tick from, Tick to, std::vector<CanRecord>& frames);
  void take(bool bit, Tick at, std::vector<CanRecord>& frames);
  void take_stuffed(bool bit, std::vector<CanRecord>& frames);
  void take_tail(bool bit, std::vector<CanRecord>& frames);
  void interpret();
  [[nodiscard]] std::uint32_t field(std::size_t first, std::size_t count) const;
  void fail(std::uint32_t error_class, std::uint8_t how, std::uint8_t where, std::vector<CanRecord>& frames);

  double bit_;
  bool level_ = true;
  Tick level_since_ = 0;  // tick at which the present level began, as far as known
  Tick end_ = 0;
  std::size_t bits_taken_ = 0;  // number of bits of the present level that were already handled

  State state_ = State::waiting;
  unsigned recessive_ = 0;  // number of consecutive recessive bits before the present time
  unsigned run_ = 0;        // number of consecutive equal bits in the stuffed part of a frame
  bool before_ = true;
  std::vector<bool> bits_;  // bits of the present frame without stuff bits, from the start of the frame on
  std::size_t length_ = 0;  // number of bits from the start of the frame to the end of its CRC; 0: not known yet
  unsigned tail_ = 0;
  CanRecord record_{};
};

}  // namespace absenc::capture
