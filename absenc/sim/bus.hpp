// SPDX-License-Identifier: Apache-2.0
// Several devices on one half-duplex line as one machine, for a carrier that knows no bits: a pseudo-terminal.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/link/step.hpp"

namespace absenc::sim {

/// Not a Line: without bits there is no time in which one could be simulated.
///
/// Every device hears what comes, and what the others send. Characters that are sent at the same time reach the line as
/// their AND, as in Line; they are aligned to whole characters.
class Bus final : public Machine<std::uint8_t> {
 public:
  /// The devices must outlive the bus. `character` is the line time of one.
  Bus(const std::vector<Machine<std::uint8_t>*>& devices, Time character);

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;

 private:
  enum class Doing : std::uint8_t {
    waiting,
    pending,  // has something to send
    sending,
    done,
  };
  struct Node {
    Machine<std::uint8_t>* device;
    Doing doing = Doing::waiting;
    Step<std::uint8_t> wait{};        // what it asked for last
    Time timer = never;               // when that is due
    Time at{};                        // pending: when it begins
    std::vector<std::uint8_t> out{};  // pending, sending
  };

  void all_sent(const Event<std::uint8_t>& event);
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
