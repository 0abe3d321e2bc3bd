// SPDX-License-Identifier: Apache-2.0
// A Port for the host's end of a simulated line.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "absenc/link/port.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::sim {

/// A clock that virtual time follows. Without functions, time jumps from event to event.
struct RealTime {
  /// Function that returns the time of the clock.
  std::function<Time()> now;
  /// Sleeps until the given time of the clock, or wakes up earlier. May throw to end a wait.
  std::function<void(Time)> sleep_until;
};

/// A port at the host's end of a private line with one device, in virtual time from 0 on.
template <class Item>
class SimPort final : public Port<Item> {
 public:
  /// Makes a line to `device`, which must outlive the port. Throws std::invalid_argument if only one function of
  /// `real_time` is set.
  SimPort(LinkKind kind, LineSettings settings, Machine<Item>& device, RealTime real_time = {});

  [[nodiscard]] Time now() override;
  /// Begins a step. A transfer or pulse is delayed until an abandoned earlier one has been sent.
  void begin(const Step<Item>& step) override;
  /// Blocks until the next event. Without a RealTime, throws std::logic_error if none can come.
  [[nodiscard]] Event<Item> wait(const Step<Item>& step) override;

  /// Returns the simulated line, so that callers can observe it.
  [[nodiscard]] Line<Item>& line() { return line_; }

  /// Sets whether the host receives what it sends.
  void set_echo(bool echo) { line_.set_echo(host_node_, echo); }

 private:
  struct QueuedEvent {
    Event<Item> event;
    std::vector<Item> items;
  };
  // The machine at the host's end: passes on the steps of the port's user and queues the events.
  class HostEnd final : public Machine<Item> {
   public:
    void feed(const Event<Item>& event) override;
    Step<Item> next(Time now) override;

    [[nodiscard]] bool empty() const { return queued_ == 0; }
    void push(const Event<Item>& event);
    /// Takes out the oldest event and swaps its items with `items`.
    Event<Item> pop(std::vector<Item>& items);
    /// Removes all queued events of kind `sent`.
    void drop_sent();

    Step<Item> waiting{};
    const Step<Item>* beginning = nullptr;
    bool sending = false;

   private:
    QueuedEvent& queued(std::size_t number);

    // A ring buffer of events. Its elements keep their memory, so that a port in use allocates none.
    std::vector<QueuedEvent> ring_;
    std::size_t first_ = 0;
    std::size_t queued_ = 0;
  };

  void keep_pace();
  void advance(const Step<Item>& step);
  template <class Done>
  void run_until(const Done& done);

  RealTime real_time_;
  Time start_{};          // time of the caller's clock at which virtual time begins
  Time last_event_at_{};  // time of the last reported event, or of the last call of `now` if this was later
  Line<Item> line_;
  HostEnd host_end_;
  typename Line<Item>::Node host_node_;
  std::vector<Item> items_;  // items of the event that `wait` returned last
};

extern template class SimPort<std::uint8_t>;
extern template class SimPort<CanFrame>;

}  // namespace absenc::sim
