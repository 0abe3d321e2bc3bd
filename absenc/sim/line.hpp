// SPDX-License-Identifier: Apache-2.0
// A line in virtual time with any number of machines, for every kind of link.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <queue>
#include <span>
#include <vector>

#include "absenc/link/step.hpp"

namespace absenc::sim {

/// The two roles of a node: host or device.
enum class NodeRole : std::uint8_t { host, device };

/// One shared line with the machines on it.
///
/// A character of more than 8 data bits carries two bytes, which arrive one after the other. Overlapping characters on
/// one pair of wires are combined by AND. CAN frames are arbitrated by identifier; frames that begin together with the
/// same identifier but other data are a `line_error` for every node. A node receives its own characters only with
/// `set_echo`. A machine that begins a transfer or pulse before its last one was sent causes a std::logic_error, except
/// a transfer of a device on an SPI or clocked link.
template <class Item>
class Line {
 public:
  /// Index of a machine on the line.
  using Node = std::size_t;
  /// Called at an `emit` step of a machine. Returns false to end the machine.
  using OnEmit = std::function<bool()>;
  /// Called at the end of every byte of a character, and of every CAN frame, on the wire.
  using Observer = std::function<void(Node sender, Time start, Time end, const Item& item)>;
  /// One transfer of SPI bytes or clocked bits. The last byte is left-aligned.
  struct Transfer {
    Time start;                 ///< spi: time of chip select; clocked: time of the first clock edge
    Time end;                   ///< End of the last bit of the transfer.
    std::size_t bits;           ///< number of clocks of the transfer; SPI has eight per byte
    std::span<const Item> out;  ///< Items that the host sent.
    std::span<const Item> in;   ///< Items that the host received.
    Time lead{};                ///< Time from chip select to the first clock.
    Time held_low = never;  ///< clocked: time from which the clock line was held low before `start`; never: it was not
    Time low_after{};       ///< clocked: time for which the device drives the data line low after the last clock edge
    /// Bidirectional clocked: number of bits in `out`; those in `in` follow them.
    std::size_t out_bits = 0;
    /// Bidirectional clocked: end of the previous transfer, from which on the clock line rests low; never: it rested
    /// high.
    Time goes_on_from = never;
    bool goes_on = false;  ///< bidirectional clocked: the clock line rests low behind the transfer
  };
  /// Called at the end of every transfer of SPI bytes or clocked bits that has at least one bit.
  using TransferObserver = std::function<void(const Transfer& transfer)>;
  /// Called at the beginning of every pulse.
  using PulseObserver = std::function<void(ExtraWire wire, Time start, Time end)>;

  /// Makes a line without machines on it.
  Line(LinkKind kind, LineSettings settings);
  ~Line();
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  /// Attaches a machine, which must outlive the line or be replaced.
  Node attach(NodeRole role, Machine<Item>& machine, const OnEmit& on_emit = {});
  /// Replaces the machine of `node`, from now on. A transfer of the old machine is cut off.
  void replace(Node node, Machine<Item>& machine);
  /// Takes the steps of the node's machine. Call it after the machine was changed by something else than an event.
  void wake(Node node);
  /// Sets whether a node receives what it sends.
  void set_echo(Node node, bool echo);
  /// Makes the line call `observer` for each byte of a character, or CAN frame, on it.
  void observe(Observer observer);
  /// Makes the line call `observer` for each transfer of SPI bytes or clocked bits.
  void observe_transfers(TransferObserver observer);
  /// Makes the line call `observer` for each pulse on an extra wire.
  void observe_pulses(PulseObserver observer);

  /// Returns the virtual time.
  [[nodiscard]] Time now() const { return now_; }
  /// Returns whether a node is host or device.
  [[nodiscard]] NodeRole role(Node node) const;
  /// Returns whether the machine of a node has ended.
  [[nodiscard]] bool done(Node node) const;
  /// Returns a time such that all items that began before it have been reported to the observers.
  [[nodiscard]] Time settled() const;
  /// Returns the time of the next scheduled event, or `never` if none is scheduled.
  [[nodiscard]] Time next_event() const;

  /// Handles the next event and advances `now` to it. Returns false if no event is scheduled.
  bool step();
  /// Handles all events up to and including `limit`; then `now` is at least `limit`.
  void run_until(Time limit);
  /// Runs until the node is done. Returns false when `limit` is reached first or no event is left.
  bool run(Node node, Time limit = never);

 private:
  struct State;
  struct ScheduledEvent {
    enum class Kind : std::uint8_t { begin, character, frame, turned, transferred, finished, arbitrate } kind;
    Time at;
    // events with the same time are handled in ascending `order`, but `arbitrate` after all others
    std::uint64_t order;
    Node node;
    // `begin_generation` of the node when the event was scheduled: after a newer transfer the event no longer counts.
    std::uint64_t generation;
    bool operator>(const ScheduledEvent& other) const {
      if (at != other.at) return at > other.at;
      // All nodes that begin a CAN frame at this time take part in the arbitration, so it comes last.
      if ((kind == Kind::arbitrate) != (other.kind == Kind::arbitrate)) return kind == Kind::arbitrate;
      return order > other.order;
    }
  };

  void schedule(typename ScheduledEvent::Kind kind, Time at, Node node);
  void serve(Node node);
  void accept_step(Node node, const Step<Item>& step);
  void feed(Node node, const Event<Item>& event);
  void arm(State& state);
  [[nodiscard]] Node next_deadline() const;
  void deadline(Node node);
  void finish(Node node);

  void begin(Node node);
  void begin_characters(Node node);
  void frame_character(Node sender);
  void end_character(Node node);
  void deliver(Node node, Node sender, const Item& item, bool garbled);
  void begin_transfer(Node node);
  void turn_data_line(Node node);
  void end_transfer(Node node);
  void read_driven_bits(const State& host, std::vector<Item>& in) const;
  void arbitrate();
  void end_frame(Node node);
  [[nodiscard]] bool receives_from(const State& receiver, const State& sender) const;
  [[nodiscard]] bool busy_towards(const State& node) const;

  LinkKind kind_;
  LineSettings settings_;
  Time now_{};
  std::uint64_t order_ = 0;
  std::vector<std::unique_ptr<State>> nodes_;
  std::priority_queue<ScheduledEvent, std::vector<ScheduledEvent>, std::greater<>> scheduled_;
  Observer observer_;
  TransferObserver transfer_observer_;
  PulseObserver pulse_observer_;
  bool frame_on_bus_ = false;
  // Items of the SPI or clocked transfer, and senders of the CAN frame, that ends now; members, so that a line in use
  // allocates nothing.
  std::vector<Item> transferred_in_{};
  std::vector<Item> transferred_out_{};
  std::vector<Node> frame_senders_{};
};

extern template class Line<std::uint8_t>;
extern template class Line<CanFrame>;

}  // namespace absenc::sim
