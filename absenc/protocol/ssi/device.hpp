// SPDX-License-Identifier: Apache-2.0
// A virtual SSI encoder: a shift register that loads a new word when the monoflop time is over.
#pragma once

#include <algorithm>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/clocked_device.hpp"
#include "absenc/protocol/ssi/frame.hpp"

namespace absenc::ssi {

/// A virtual SSI encoder.
class VirtualEncoder final : public author::ClockedDevice {
 public:
  /// Creates an encoder that is off until `power_on`. `shaft` must outlive it.
  VirtualEncoder(const Format& format, const Shaft& shaft) : format_(format), shaft_(&shaft) {}

 private:
  void selected(Time at, Time period, bool held_low, author::DrivenBits& bits) override;
  void clocked(Time at, std::size_t clocks) override;

  [[nodiscard]] Time monoflop() const {
    return format_.monoflop == Time{} ? format_.pause : std::min(format_.monoflop, format_.pause);
  }

  Format format_;
  const Shaft* shaft_;
  Word latched_{};
  // Number of clocks since the word `latched_` was stored. If the host clocks again within the monoflop time, the
  // number is first reduced modulo the number of bits of two words.
  std::size_t shifted_ = 0;
  Time free_at_{};  // end of the monoflop time after the last clock
};

}  // namespace absenc::ssi
