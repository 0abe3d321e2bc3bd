// SPDX-License-Identifier: Apache-2.0
// A line in virtual time with any number of machines on it: every kind of link, exact to the nanosecond.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <queue>
#include <span>
#include <vector>

#include "absenc/link/step.hpp"

namespace absenc::sim {

enum class Role : std::uint8_t { host, device };

/// One shared line. Hosts and devices are machines of the same kind; the role only tells who is master where the
/// wire has one (SPI, clocked, pulses) and which pair a full-duplex node drives.
///
/// Characters that overlap on one pair reach everybody as the AND of both (an idle line is high); a receiver sees
/// those that begin during another as part of that one. CAN frames are arbitrated by identifier; the same identifier
/// with other data is a `line_error` for everybody. A node hears its own characters only with `set_echo`, then
/// before their `sent`. A machine that begins a transfer during another one of its own is a std::logic_error.
template <class Item>
class Line {
 public:
  using Node = std::size_t;
  /// Called at an `emit` step; returns whether the node goes on (false: it is treated as done).
  using OnEmit = std::function<bool()>;
  /// Called for every character or CAN frame that was on the wire, at its end.
  using Observer = std::function<void(Node sender, Time start, Time end, const Item& item)>;
  /// Of SPI bytes or of `bits` clocks: what the host sent and what it received, the last byte left-aligned. `lead` is
  /// the time from `start`, when the chip was selected, to the first clock.
  struct Transfer {
    Time start;
    Time end;
    std::size_t bits;
    std::span<const Item> out;
    std::span<const Item> in;
    Time lead{};
    Time held_low = never;  // clocked: since when the clock line was held low before `start`; never: it was idle
    Time low_after{};       // clocked: from the last edge of the clock the device drives the data line low for so long
  };
  /// Called for every transfer of SPI or clocked bits, at its end.
  using TransferObserver = std::function<void(const Transfer& transfer)>;
  /// Called for every pulse, at its beginning.
  using PulseObserver = std::function<void(ExtraWire wire, Time start, Time end)>;

  Line(LinkKind kind, LineSettings settings);
  ~Line();
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  /// `machine` must outlive the line or be replaced. It is asked for its first step at once.
  Node attach(Role role, Machine<Item>& machine, const OnEmit& on_emit = {});
  /// The node goes on with another machine, from now. What the old one was still sending is cut off.
  void replace(Node node, Machine<Item>& machine);
  /// Asks the machine for its next step, after something other than an event has changed it.
  void wake(Node node);
  void set_echo(Node node, bool echo);
  void observe(Observer observer);
  void observe_transfers(TransferObserver observer);
  void observe_pulses(PulseObserver observer);

  [[nodiscard]] Time now() const { return now_; }
  [[nodiscard]] Role role(Node node) const;
  [[nodiscard]] bool done(Node node) const;
  /// Observers were told everything that has begun before this time.
  [[nodiscard]] Time settled() const;
  /// Time of the next event, or `never`.
  [[nodiscard]] Time next_event() const;

  /// Handles the next event and advances `now` to it. False when there is none.
  bool step();
  /// Handles everything up to and including `limit`; then `now` is `limit`.
  void run_until(Time limit);
  /// Until the node is done. False when `limit` came first or nothing is left to happen.
  bool run(Node node, Time limit = never);

 private:
  struct State;
  struct ScheduledEvent {
    enum class Kind : std::uint8_t { begin, character, frame, transferred, finished, arbitrate } kind;
    Time at;
    std::uint64_t order;  // the first scheduled comes first
    Node node;
    std::uint64_t generation;  // void when the node has moved on
    bool operator>(const ScheduledEvent& other) const {
      if (at != other.at) return at > other.at;
      // Everybody who begins a CAN frame at that time takes part.
      if ((kind == Kind::arbitrate) != (other.kind == Kind::arbitrate)) return kind == Kind::arbitrate;
      return order > other.order;
    }
  };

  void schedule(typename ScheduledEvent::Kind kind, Time at, Node node);
  void serve(Node node);
  void take_up(Node node, const Step<Item>& step);
  void feed(Node node, const Event<Item>& event);
  void arm(State& state);
  [[nodiscard]] Node next_deadline() const;
  void deadline(Node node);
  void finish(Node node);

  void begin(Node node);
  void begin_characters(Node node);
  void frame_character(Node sender);
  void end_character(Node node);
  void hear(Node node, Node sender, const Item& item, bool garbled);
  void begin_transfer(Node node);
  void end_transfer(Node node);
  void arbitrate();
  void end_frame(Node node);
  [[nodiscard]] bool hears(const State& receiver, const State& sender) const;
  [[nodiscard]] bool busy_towards(const State& node) const;

  LinkKind kind_;
  LineSettings settings_;
  Time now_{};
  std::uint64_t order_ = 0;
  std::vector<std::unique_ptr<State>> nodes_;
  std::priority_queue<ScheduledEvent, std::vector<ScheduledEvent>, std::greater<>> happenings_;
  Observer observer_;
  TransferObserver transfer_observer_;
  PulseObserver pulse_observer_;
  bool frame_on_bus_ = false;
};

extern template class Line<std::uint8_t>;
extern template class Line<CanFrame>;

}  // namespace absenc::sim
