// SPDX-License-Identifier: Apache-2.0
// A virtual RAA38S6 on an asynchronous line: transmits by itself, on a pulse, or when its number is asked for.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/raa38/serial/frame.hpp"

namespace absenc::raa38::serial {

class VirtualEncoder final : public Device<std::uint8_t> {
 public:
  /// Switched off until `power_on`. `shaft` must outlive the encoder. What the format does not know is as in
  /// timing.hpp.
  VirtualEncoder(const Format& format, const Shaft& shaft);

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;

  void power_on(Time now, PowerOn kind) override;
  void power_off(Time now) override;
  void raise_alarms(std::uint32_t) override {}  // a frame has no room for any
  void lower_alarms(std::uint32_t) override {}
  [[nodiscard]] MutableBytes memory() override { return memory_; }
  [[nodiscard]] std::uint32_t memory_version() const override { return memory_version_; }
  [[nodiscard]] std::span<const Violation> violations() const override { return violations_; }
  [[nodiscard]] std::uint32_t violation_count() const override { return violation_count_; }
  /// Frames sent.
  [[nodiscard]] std::uint64_t answered() const override { return answered_; }

  /// How often the zero was written since it was made.
  [[nodiscard]] std::uint32_t writes() const { return writes_; }

 private:
  void triggered(const Event<std::uint8_t>& event);
  void received(Bytes bytes, Time at);
  void request_received(const Request& request, Time at);
  void set_zero(Time at);
  void send(std::uint8_t second_byte, Time latched, Time at);
  void stream(Time now);
  [[nodiscard]] Step<std::uint8_t> transmit();
  void violate(std::string_view rule, Time at);
  [[nodiscard]] std::uint32_t shaft_counts(Time at) const;

  Format format_;
  Time period_;
  const Shaft* shaft_;
  std::array<std::uint8_t, 4> memory_{};  // the zero position, little endian
  std::uint32_t memory_version_ = 0;
  std::uint32_t writes_ = 0;
  bool on_ = false;
  Time due_{};  // timing: when the next frame begins
  FrameBytes heard_;
  FrameBytes frame_;
  std::size_t sent_ = 0;  // characters of it that are out
  bool frame_pending_ = false;
  bool transmitting_ = false;
  Time frame_at_{};
  Buffer<Violation, 16> violations_;
  std::uint32_t violation_count_ = 0;
  std::uint64_t answered_ = 0;
};

}  // namespace absenc::raa38::serial
