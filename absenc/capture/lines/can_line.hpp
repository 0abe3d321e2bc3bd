// SPDX-License-Identifier: Apache-2.0
// Classic CAN frames from the level changes of a bus (ISO 11898-1): recessive is high.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// What an error frame tells, in words without an end; for frames of controllers too.
[[nodiscard]] std::string_view text_of_error(const CanFrame& error);

/// Decodes part after part. Each falling edge sets the clock anew, as in a receiver. What breaks the rules becomes an
/// error frame as the kernel would report it (linux/can/error.h): its identifier says what (0x08 protocol, 0x20 nobody
/// acknowledged), of a protocol error data[2] says how (0x04 bit stuffing, 0x02 form) and data[3] where (0x08 CRC).
/// After that, eleven recessive bits are waited for.
class CanDecoder {
 public:
  /// `bit` in ticks, 3 at least; need not be a whole number.
  explicit CanDecoder(double bit) : bit_(bit) {}

  /// The next part, from `first` to `end`. Where it does not follow the one before, the bus is waited for anew.
  void decode(const Changes& part, Tick first, Tick end, std::vector<CanRecord>& frames);
  /// Nothing follows.
  void finish(std::vector<CanRecord>& frames);

 private:
  enum class Doing : std::uint8_t { waiting, idle, stuffed, tail };

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
  Tick since_ = 0;  // of the level
  Tick end_ = 0;
  std::size_t told_ = 0;  // bits of the present level that were taken already

  Doing doing_ = Doing::waiting;
  unsigned recessive_ = 0;  // bits in a row
  unsigned run_ = 0;        // equal stuffed bits in a row
  bool before_ = true;
  std::vector<bool> bits_;  // without stuff bits, from the start of the frame on
  std::size_t length_ = 0;  // of them, CRC included; 0: not known yet
  unsigned tail_ = 0;
  CanRecord record_{};
};

}  // namespace absenc::capture
