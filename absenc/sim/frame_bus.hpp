// SPDX-License-Identifier: Apache-2.0
// Several nodes on one CAN bus as one machine, for a port that does not simulate bits.
#pragma once

#include <deque>
#include <vector>

#include "absenc/link/step.hpp"

namespace absenc::sim {

/// Several nodes on one CAN bus, without bit timing and collisions: frames go one by one, in order of their times. A
/// node with another bit rate than the bus neither receives nor sends.
class FrameBus final : public Machine<CanFrame> {
 public:
  /// Makes a bus of the machines in `nodes`, which must outlive it. `rate`: bit rate of the port and of all nodes at
  /// the start, in bits per second.
  FrameBus(const std::vector<Machine<CanFrame>*>& nodes, std::uint32_t rate);

  /// Processes an event that the port reports.
  void feed(const Event<CanFrame>& event) override;
  /// Returns the next step that the port must carry out.
  Step<CanFrame> next(Time now) override;

 private:
  enum class SendState : std::uint8_t {
    waiting,
    pending,  ///< the node has requested a frame that has not begun
    sending,
    done,
  };
  struct Node {
    Machine<CanFrame>* machine;
    std::uint32_t rate;
    SendState send_state = SendState::waiting;
    Time timer = never;
    Time at{};                   // while pending: time at which the node's next frame begins
    std::deque<CanFrame> out{};  // while pending or sending: frames not yet sent
  };

  void serve(Node& node, Time now);
  void report_sent(Time at);
  [[nodiscard]] Node* first_to_send();

  std::vector<Node> nodes_;
  std::uint32_t rate_;
  bool configuring_ = false;
  Node* sender_ = nullptr;  // node whose frame is being sent; null: none
  CanFrame out_{};
};

}  // namespace absenc::sim
