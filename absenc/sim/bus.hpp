// SPDX-License-Identifier: Apache-2.0
// Several devices on one half-duplex line as one machine, for a port without bit timing.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/link/step.hpp"

namespace absenc::sim {

/// Several devices on one half-duplex line, without bit timing, which sim::Line simulates.
///
/// A device does not receive bytes that are sent together with its own. Bytes that are sent at the same time reach the
/// line as their AND.
class Bus final : public Machine<std::uint8_t> {
 public:
  /// Makes a bus for the machines in `devices`, which must outlive it. `character` is the duration of one byte.
  Bus(const std::vector<Machine<std::uint8_t>*>& devices, Time character);

  /// Processes an event that the port reports.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns the next step that the port must carry out.
  Step<std::uint8_t> next(Time now) override;

 private:
  enum class SendState : std::uint8_t {
    waiting,
    pending,  ///< the device has requested a transfer that has not begun
    sending,
    done,
  };
  struct Node {
    Machine<std::uint8_t>* device;
    SendState send_state = SendState::waiting;
    Step<std::uint8_t> wait{};        // last wait step of the device
    Time timer = never;               // time of the device's next `timer` event
    Time at{};                        // while pending: time at which the device's transfer begins
    std::vector<std::uint8_t> out{};  // while pending or sending: bytes of the device's transfer
  };

  void report_sent(const Event<std::uint8_t>& event);
  void serve(Node& node, Time now);
  void merge();
  [[nodiscard]] Time first_begin() const;
  [[nodiscard]] Step<std::uint8_t> wait_step() const;

  std::vector<Node> nodes_;
  Time character_;
  bool sending_ = false;
  std::vector<std::uint8_t> out_;
};

}  // namespace absenc::sim
