// SPDX-License-Identifier: Apache-2.0
// Several nodes on one CAN bus as one machine, for a carrier that knows no bits: an adapter, or a virtual interface.
#pragma once

#include <deque>
#include <vector>

#include "absenc/link/step.hpp"

namespace absenc::sim {

/// Every node hears what comes, and what the others send. Without bits there is no arbitration and no collision: what
/// is due at the same time goes out by identifier, and two frames of one identifier one after the other. A node whose
/// `configure` asks for another bit rate than the carrier has hears nothing and is not heard.
class FrameBus final : public Machine<CanFrame> {
 public:
  /// The nodes must outlive the bus. `rate`: of the carrier, until the first node changes it.
  FrameBus(const std::vector<Machine<CanFrame>*>& nodes, std::uint32_t rate);

  void feed(const Event<CanFrame>& event) override;
  Step<CanFrame> next(Time now) override;

 private:
  enum class Doing : std::uint8_t {
    waiting,
    pending,  // has something to send
    sending,
    done,
  };
  struct Node {
    Machine<CanFrame>* machine;
    std::uint32_t rate;
    Doing doing = Doing::waiting;
    Time timer = never;
    Time at{};                   // pending: when it begins
    std::deque<CanFrame> out{};  // pending, sending
  };

  void serve(Node& node, Time now);
  void all_sent(Time at);
  [[nodiscard]] Node* first_to_send();

  std::vector<Node> nodes_;
  std::uint32_t rate_;
  bool configuring_ = false;
  Node* sender_ = nullptr;  // whose first frame is on its way
  CanFrame out_{};
};

}  // namespace absenc::sim
