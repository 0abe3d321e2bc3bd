// SPDX-License-Identifier: Apache-2.0
// A virtual RAA38S6 that is a Modbus RTU slave. Several of them can share a line.
#pragma once

#include <cstdint>

#include "absenc/protocol/modbus/server.hpp"
#include "absenc/protocol/raa38/modbus/frame.hpp"
#include "absenc/protocol/raa38/settings.hpp"

namespace absenc::raa38::rtu {

/// A virtual RAA38S6 that is a Modbus RTU slave.
class VirtualEncoder final : public modbus::Server {
 public:
  /// Creates an encoder that is off until `power_on`. `shaft` must outlive it.
  VirtualEncoder(const Format& format, const Shaft& shaft)
      : Server(format.line()),
        format_(format),
        settings_(format.address, static_cast<std::uint8_t>(format.baud), format.bits, shaft) {}

  void raise_alarms(std::uint32_t) override {}
  /// Does nothing: this encoder reports no alarms.
  void lower_alarms(std::uint32_t) override {}
  [[nodiscard]] MutableBytes memory() override { return settings_.memory(); }
  [[nodiscard]] std::uint32_t memory_version() const override { return settings_.version(); }

  /// Returns the settings in the encoder's memory.
  [[nodiscard]] const Settings& settings() const { return settings_; }
  /// Returns the stored address.
  [[nodiscard]] std::uint8_t address() const { return settings_.number(); }
  /// Returns the stored baud rate in bits per second.
  [[nodiscard]] std::uint32_t baud() const { return bauds[settings_.rate()]; }

 private:
  void started() override;
  void request(Bytes body, Time at, modbus::FrameBytes& reply) override;
  void read(Bytes body, Time at, modbus::FrameBytes& reply);
  void append_position(std::uint16_t registers, Time at, modbus::FrameBytes& reply) const;
  void set_address(Bytes body, Time at, modbus::FrameBytes& reply);
  void set_parameter(Bytes body, Time at, modbus::FrameBytes& reply);
  bool apply(std::uint8_t parameter, Time at);
  void wrote(bool changed, Time now);

  Format format_;
  Settings settings_;
  std::uint32_t recent_settings_ = 0;  // number of settings written within the minute that began at `recent_since_`
  Time recent_since_{};
};

}  // namespace absenc::raa38::rtu
