// SPDX-License-Identifier: Apache-2.0
// A virtual SSI encoder: a shift register that is loaded when its pause is over.
#pragma once

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/ssi/frame.hpp"
#include "absenc/protocol/ssi/timing.hpp"

namespace absenc::ssi {

class VirtualEncoder final : public Device<std::uint8_t> {
 public:
  VirtualEncoder(const Format& format, const Shaft& shaft, const Timing& timing = {})
      : format_(format), timing_(timing), shaft_(&shaft) {}

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;

  void power_on(Time, PowerOn) override { powered_ = true; }
  void power_off(Time) override { powered_ = false; }
  void raise_alarms(std::uint32_t bits) override { alarms_ |= bits; }
  void lower_alarms(std::uint32_t bits) override { alarms_ &= ~bits; }
  [[nodiscard]] MutableBytes memory() override { return {}; }
  [[nodiscard]] std::uint32_t memory_version() const override { return 0; }
  [[nodiscard]] std::span<const Violation> violations() const override { return violations_; }
  [[nodiscard]] std::uint32_t violation_count() const override { return violation_count_; }
  [[nodiscard]] std::uint64_t answered() const override { return answered_; }

  [[nodiscard]] Word word(Time at) const { return word_of(format_.word, shaft_->at(at), alarms_); }

 private:
  void selected(Time at, Time period);
  void violate(std::string_view rule, Time at);

  Format format_;
  Timing timing_;
  const Shaft* shaft_;
  bool powered_ = false;
  std::uint32_t alarms_ = 0;
  Word latched_{};
  std::size_t shifted_ = 0;  // bits of `latched_` that were clocked out
  BitBuffer<frame_capacity> bits_;
  bool driving_ = false;
  bool answering_ = false;
  Time free_at_{};
  Buffer<Violation, 16> violations_;
  std::uint32_t violation_count_ = 0;
  std::uint64_t answered_ = 0;
};

}  // namespace absenc::ssi
