// SPDX-License-Identifier: Apache-2.0
// A virtual RAA38S6 on CAN: the node that the document describes, with its settings in a memory that wears out.
#pragma once

#include <array>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/raa38/can/frame.hpp"

namespace absenc::raa38::can {

class VirtualNode final : public Device<CanFrame> {
 public:
  VirtualNode(const Format& format, const Shaft& shaft);

  void feed(const Event<CanFrame>& event) override;
  Step<CanFrame> next(Time now) override;

  void power_on(Time now, PowerOn kind) override;
  void power_off(Time now) override;
  void raise_alarms(std::uint32_t) override {}
  void lower_alarms(std::uint32_t) override {}
  /// Node, bit rate, direction and zero; the last four bytes count how often they were written.
  [[nodiscard]] MutableBytes memory() override { return memory_; }
  [[nodiscard]] std::uint32_t memory_version() const override { return memory_version_; }
  [[nodiscard]] std::span<const Violation> violations() const override { return violations_; }
  [[nodiscard]] std::uint32_t violation_count() const override { return violation_count_; }
  [[nodiscard]] std::uint64_t answered() const override { return answered_; }

  [[nodiscard]] std::uint8_t node() const { return memory_[0]; }
  [[nodiscard]] std::uint32_t rate() const { return rate_of_index(memory_[1])->bits_per_second; }
  [[nodiscard]] bool is_negative() const { return memory_[2] != 0; }
  /// Settings written since it was made.
  [[nodiscard]] std::uint32_t wear() const;
  [[nodiscard]] std::uint32_t position(Time at) const;

 private:
  struct Pending {
    CanFrame frame;
    Time at;
  };

  void hear(const CanFrame& frame, Time at);
  void obey(const OrderInfo& info, std::uint8_t value, Time at);
  void configure(const OrderInfo& info, std::uint8_t value, Time at);
  void set_direction(std::uint8_t value, Time at);
  void send_by_itself(std::uint8_t readings_per_s, Time from);
  void answer(const CanFrame& frame, Time at);
  void write(std::size_t first, Bytes bytes, Time at);
  void violate(std::string_view rule, Time at);
  [[nodiscard]] std::uint32_t zero() const;
  [[nodiscard]] std::uint32_t raw(Time at) const;
  [[nodiscard]] Time period() const;

  Format format_;
  const Shaft* shaft_;
  std::array<std::uint8_t, 11> memory_{};
  std::uint32_t memory_version_ = 0;

  bool powered_ = false;
  bool configuring_ = false;  // configuration mode
  bool sending_ = false;
  bool switch_rate_ = false;  // when all is sent
  bool tell_rate_ = false;    // this end of the line must be set
  std::uint8_t readings_per_s_ = 0;
  Time next_cyclic_ = never;
  Buffer<Pending, 8> pending_;  // answers, the first due first
  CanFrame out_{};
  std::uint64_t answered_ = 0;
  Buffer<Violation, 16> violations_;
  std::uint32_t violation_count_ = 0;
};

}  // namespace absenc::raa38::can
