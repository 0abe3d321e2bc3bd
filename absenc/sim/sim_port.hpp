// SPDX-License-Identifier: Apache-2.0
// The host's end of a simulated line as a Port: `sim:` encoders are read by the same code as real ones.
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "absenc/link/port.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::sim {

/// Holds virtual time to a clock of the caller's choice. With neither function, time jumps from event to event.
struct RealTime {
  std::function<Time()> now;
  /// May return early, and may throw to break off a wait.
  std::function<void(Time)> sleep_until;
};

/// A private line with one device on it. Times are virtual, start at 0 when the port is made and are exact to the
/// nanosecond; with a RealTime they keep pace with it, however late the caller comes.
template <class Item>
class SimPort final : public Port<Item> {
 public:
  /// `device` must outlive the port.
  SimPort(LinkKind kind, LineSettings settings, Machine<Item>& device, RealTime real_time = {});

  [[nodiscard]] Time now() override;
  /// A transfer or pulse during another one, which somebody broke off, waits until that has been sent.
  void begin(const Step<Item>& step) override;
  /// Without a RealTime, a wait for something that can never happen is a std::logic_error.
  [[nodiscard]] Event<Item> wait(const Step<Item>& step) override;

  /// To observe it.
  [[nodiscard]] Line<Item>& line() { return line_; }

  void set_echo(bool echo) { line_.set_echo(host_node_, echo); }

 private:
  struct Heard {
    Event<Item> event;
    std::vector<Item> items;
  };
  // The machine at the host's end: passes steps from the port's user and collects what happens.
  class Hand final : public Machine<Item> {
   public:
    void feed(const Event<Item>& event) override;
    Step<Item> next(Time now) override;

    Step<Item> waiting{};
    const Step<Item>* beginning = nullptr;
    bool sending = false;
    std::deque<Heard> heard;
  };

  void keep_pace();
  void advance(const Step<Item>& step);
  template <class Done>
  void run_until(const Done& done);

  RealTime real_time_;
  Time start_{};  // of virtual time, on the caller's clock
  Time told_{};   // the last that was
  Line<Item> line_;
  Hand hand_;
  typename Line<Item>::Node host_node_;
  std::vector<Item> items_;  // of the event handed out last
};

extern template class SimPort<std::uint8_t>;
extern template class SimPort<CanFrame>;

}  // namespace absenc::sim
