// SPDX-License-Identifier: Apache-2.0
// The interface between a protocol and its port: a machine is fed events and returns steps.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/core/time.hpp"
#include "absenc/link/can.hpp"
#include "absenc/link/line.hpp"

namespace absenc {

/// The next action that a machine requests. Item is std::uint8_t (characters, SPI bytes, clocked bits packed MSB first)
/// or CanFrame. The port adds its own latency to `answer` and `gap`.
template <class Item>
struct Step {
  /// Actions that a machine requests from its port.
  enum class Kind : std::uint8_t {
    wait,      ///< no action until the next event
    transfer,  ///< not before `at`: send `out` (spi: and receive max(out, expect) items; clocked: clock `bits`)
    pulse,     ///< drive the wire `wire` active for the time `width`, beginning not before `at`
    /// switch this end of the line to `rate` bits per second; all other settings of the line stay as they are
    configure,
    emit,  ///< a result is ready; the caller reads it and calls `next` again
    done,  ///< the conversation has ended
  };

  Kind kind = Kind::wait;  ///< requested action
  ExtraWire wire{};        ///< pulse: the wire to drive
  /// Transfer, wait: until the next step of this machine, no other machine may send a request on the line.
  bool holds_line = false;
  bool hold_low = false;  ///< transfer on a clocked link: the clock line, which idles high, is held low until `at`
  /// Transfer on a bidirectional clocked link: afterwards the clock line rests low, because the next transfer belongs
  /// to the same exchange.
  bool goes_on = false;
  /// Transfer of characters: `out` is sent in frames of this many items, with pauses of `width`; 0: in one piece.
  std::uint8_t frame = 0;
  std::span<const Item> out{};  ///< transfer: items to send; valid until the next feed
  std::size_t expect = 0;       ///< transfer, wait: number of items still expected; 0: unknown, or none
  /// Transfer on a clocked link: number of clocks that the host gives; on the device side the number of bits that hosts
  /// read, 0 if not stated.
  std::size_t bits = 0;
  /// Transfer on a bidirectional clocked link: the host drives the data line with `out` during this number of clocks,
  /// then it releases the line.
  std::size_t out_bits = 0;
  /// Configure: new rate in bits per second. Transfer on a bidirectional clocked link: rate of the clock for this
  /// transfer; 0: it stays as it is.
  std::uint32_t rate = 0;
  Time at{};  ///< transfer, pulse: earliest time to begin; wait: time of `timer`, if in the future
  /// Transfer, wait: `silence` is due this long after `sent` if nothing is received; 0: no limit.
  Time answer{};
  Time gap{};  ///< transfer, wait: `silence` is due this long after an item; 0: no limit
  /// Transfer with `goes_on`: longest duration of the rest of the exchange. Pulse: its duration. Transfer in frames:
  /// the pause between two frames. Clocked device: the time for which the device drives the data line low after the
  /// last clock edge, behind the bits of `out`.
  Time width{};

  /// Returns the byte that a host samples after all of `out`, on an SPI or clocked link whose device sends `out`.
  [[nodiscard]] constexpr std::uint8_t behind_out() const { return width > Time{} ? 0x00 : 0xFF; }
};

/// An event on the line, which a port reports to a machine.
template <class Item>
struct Event {
  /// Kinds of events at a port.
  enum class Kind : std::uint8_t {
    sent,      ///< the transfer or pulse has ended (device side of spi and clocked: the host stopped clocking)
    received,  ///< `items` were received from the line
    silence,   ///< the `answer` or `gap` limit of the last step has passed
    timer,     ///< the time `at` of the last wait step was reached
    /// Device side: the host has activated chip select, or given the first clock edge.
    selected,
    triggered,  ///< device side: a pulse on `wire` has begun
    /// A damaged character or CAN frame was received, or a CAN frame could not be sent.
    line_error,
  };

  Kind kind = Kind::timer;        ///< kind of the event
  Time at{};                      ///< time of the event
  std::span<const Item> items{};  ///< received: the items that were received; valid during the call
  /// Sent, device side of a clocked link: number of clocks counted. Received, on a bidirectional clocked link: number
  /// of bits in `items`.
  std::size_t bits = 0;
  /// Received, device side of a bidirectional clocked link: number of clocks of the exchange before the bits.
  std::size_t clocks_before = 0;
  ExtraWire wire{};       ///< triggered: the wire of the pulse
  bool held_low = false;  ///< selected on a clocked link: the clock line was held low before the transfer, not idle
  bool idle_low = false;  ///< received on a clocked link: the data line was low already before the first bit
  /// Triggered: duration of the pulse. Device side, selected (clocked) or sent (SPI): period of the clock, 0 if not
  /// known. Received, on a bidirectional clocked link: time from the edge at which the encoder changes a bit until the
  /// port samples it, 0 for half a period.
  Time width{};
  Time lead{};  ///< sent, device side of an SPI link: time from chip select to the first clock
  /// Uncertainty of `at`: the event may have been earlier by up to this time; 0: none, or not known.
  Time late{};
};

/// A protocol's side of a conversation. Call `next` at the start and after each `feed`, until `wait` or `done`. Call
/// both from one context.
template <class Item>
struct Machine {
  /// Processes an event that the port reports.
  virtual void feed(const Event<Item>& event) = 0;
  /// Returns the next step that the port must carry out.
  virtual Step<Item> next(Time now) = 0;

 protected:
  ~Machine() = default;  // protected, because firmware would link operator delete for a public virtual one
};

/// A step on a line of bytes.
using ByteStep = Step<std::uint8_t>;
/// An event on a line of bytes.
using ByteEvent = Event<std::uint8_t>;

}  // namespace absenc
