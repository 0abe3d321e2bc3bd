// SPDX-License-Identifier: Apache-2.0
// A virtual RAA38S6 on an asynchronous line: transmits by itself, on a pulse, or on a request with its number.
#pragma once

#include <optional>

#include "absenc/protocol/raa38/serial/frame.hpp"

namespace absenc::raa38::serial {

/// A virtual encoder; its memory is its zero. Unknown members of the format have the values of frame.hpp.
class VirtualEncoder final : public author::BusDevice<Protocol, VirtualEncoder, 4> {
 public:
  using BusDevice::BusDevice;

  /// Processes an event of the port, such as received data or silence.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns what the port must do next, such as send or wait.
  Step<std::uint8_t> next(Time now) override;
  /// Switches the encoder off.
  void power_off(Time now) override;

  /// Returns whether a request is for this encoder.
  [[nodiscard]] bool is_mine(const Request& request) const;
  /// Returns the reply to a request; none: it is not answered.
  std::optional<Position> answer(const Request& request, Time at);

 private:
  void started(Time at) override { due_ = at; }
  void triggered(const Event<std::uint8_t>& event);
  void check_during_transmission(const Event<std::uint8_t>& event);
  [[nodiscard]] Position position(Time at) const;
  [[nodiscard]] Step<std::uint8_t> character();

  Time due_{};  // timing mode: start of the next frame
  // State of a frame that is sent character by character.
  Bytes frame_{};
  Time frame_at_{};
  std::size_t sent_ = 0;
  bool pending_ = false;
  std::uint32_t last_characters_ = 0;  // the last three characters received while a frame is sent
};

}  // namespace absenc::raa38::serial
