// SPDX-License-Identifier: Apache-2.0
// A virtual RAA38S6 on an asynchronous line.
#pragma once

#include <optional>

#include "absenc/protocol/raa38/serial/frame.hpp"

namespace absenc::raa38::serial {

/// A virtual RAA38S6 on an asynchronous line; its memory holds its zero.
class VirtualEncoder final : public author::BusDevice<Protocol, VirtualEncoder, 4> {
 public:
  using BusDevice::BusDevice;

  /// Processes an event of the port, such as received data or silence.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns what the port must do next, such as send or wait.
  Step<std::uint8_t> next(Time now) override;
  /// Switches the encoder off.
  void power_off(Time now) override;

  /// Returns whether a request is for this encoder and can be executed.
  [[nodiscard]] bool is_mine(const Request& request) const;
  /// Executes a request and returns the reply; no value if it is not answered.
  std::optional<Position> answer(const Request& request, Time at);

 private:
  void started(Time at) override { due_ = at; }
  void triggered(const Event<std::uint8_t>& event);
  void check_during_transmission(const Event<std::uint8_t>& event);
  [[nodiscard]] Position position(Time at) const;
  [[nodiscard]] Step<std::uint8_t> character();

  Time due_{};  // time of the next frame in timing mode
  // State of a transmission that is sent character by character.
  Bytes frame_{};
  Time frame_at_{};
  std::size_t sent_ = 0;
  bool pending_ = false;
  std::uint32_t last_characters_ = 0;  // last three characters that were received during transmissions
};

}  // namespace absenc::raa38::serial
