// SPDX-License-Identifier: Apache-2.0
// A virtual RAA38S6 on an asynchronous line: transmits by itself, on a pulse, or when its number is asked for.
#pragma once

#include <optional>

#include "absenc/protocol/raa38/serial/frame.hpp"

namespace absenc::raa38::serial {

/// Memory: its zero. What the format does not know is as in frame.hpp.
class VirtualEncoder final : public author::BusDevice<Protocol, VirtualEncoder, 4> {
 public:
  using BusDevice::BusDevice;

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;
  void power_off(Time now) override;

  [[nodiscard]] bool is_mine(const Request& request) const;
  std::optional<Position> answer(const Request& request, Time at);

 private:
  void started(Time at) override { due_ = at; }
  void triggered(const Event<std::uint8_t>& event);
  void hear_meanwhile(const Event<std::uint8_t>& event);
  [[nodiscard]] Position position(Time at) const;
  [[nodiscard]] Step<std::uint8_t> character();

  Time due_{};  // timing: when the next frame begins
  // Of a frame that is sent character by character:
  Bytes frame_{};
  Time frame_at_{};
  std::size_t sent_ = 0;
  bool pending_ = false;
  std::uint32_t meanwhile_ = 0;  // the last three characters that were heard while it sends
};

}  // namespace absenc::raa38::serial
