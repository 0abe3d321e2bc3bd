// SPDX-License-Identifier: Apache-2.0
// A virtual RAA38S6 as a Modbus RTU slave: address, baud rate, direction and zero survive power off, writing them
// wears, and it lists the rules its host breaks. Several of them share a line.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/modbus/server.hpp"
#include "absenc/protocol/raa38/modbus/frame.hpp"

namespace absenc::raa38::rtu {

class VirtualEncoder final : public modbus::Server {
 public:
  /// Switched off until `power_on`. `shaft` must outlive the encoder.
  VirtualEncoder(const Format& format, const Shaft& shaft);

  void raise_alarms(std::uint32_t) override {}
  void lower_alarms(std::uint32_t) override {}
  [[nodiscard]] MutableBytes memory() override { return memory_; }
  [[nodiscard]] std::uint32_t memory_version() const override { return memory_version_; }

  [[nodiscard]] std::uint8_t address() const { return memory_[address_at]; }
  [[nodiscard]] std::uint32_t baud() const { return bauds[memory_[baud_at]]; }
  [[nodiscard]] bool counts_backwards() const { return memory_[direction_at] != 0; }
  /// Settings written since it was made.
  [[nodiscard]] std::uint32_t writes() const;
  [[nodiscard]] std::uint32_t singleturn(Time now) const;

 private:
  static constexpr std::size_t address_at = 0;
  static constexpr std::size_t baud_at = 1;
  static constexpr std::size_t direction_at = 2;
  static constexpr std::size_t zero_at = 3;    // counts of the shaft, 4 bytes, little endian
  static constexpr std::size_t writes_at = 7;  // 4 bytes, little endian

  void started() override;
  void request(Bytes body, Time at, modbus::FrameBytes& reply) override;
  void read(Bytes body, Time at, modbus::FrameBytes& reply);
  void append_position(std::uint16_t registers, Time at, modbus::FrameBytes& reply) const;
  void set_address(Bytes body, Time at, modbus::FrameBytes& reply);
  void set_parameter(Bytes body, Time at, modbus::FrameBytes& reply);
  bool apply(std::uint8_t parameter, Time at);
  void write(std::size_t at, Bytes value, Time now);
  [[nodiscard]] std::uint32_t counts(Time now) const;

  Format format_;
  const Shaft* shaft_;
  std::array<std::uint8_t, writes_at + 4> memory_{};
  std::uint32_t memory_version_ = 0;
  std::uint32_t recent_settings_ = 0;  // within a minute
  Time recent_since_{};
};

}  // namespace absenc::raa38::rtu
