// SPDX-License-Identifier: Apache-2.0
// The interface between a protocol and its port: a machine is fed events and returns steps. A machine owns no port and
// no clock, so the same object runs on a real port, on a microcontroller and in virtual time. This interface is not in
// core, because it refers to lines and CAN frames, which core does not know.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/core/time.hpp"
#include "absenc/link/can.hpp"
#include "absenc/link/line.hpp"

namespace absenc {

/// The next action that a machine requests. Times are protocol time: the port adds its own latency to `answer` and
/// `gap`. Item is std::uint8_t (characters, SPI bytes, clocked bits packed MSB first) or CanFrame.
///
/// A transfer is returned once; while its reply is awaited, the machine returns `wait`. `expect`, `answer` and `gap`
/// are set in both steps: in the transfer because a microcontroller must prepare its receiver before the last bit is
/// out, in the wait because they change while items arrive. A machine that may be fed another event at the exact time
/// of its timer must compare the timer's time with `now` in `next` itself.
template <class Item>
struct Step {
  /// Actions that a machine requests from its port.
  enum class Kind : std::uint8_t {
    wait,       ///< no action until the next event
    transfer,   ///< not before `at`: send `out` (spi: and receive max(out, expect) items; clocked: clock `bits`)
    pulse,      ///< not before `at`: drive `wire` active for `width`
    configure,  ///< switch this end of the line to `rate`; all else stays as it is
    emit,       ///< a result is ready; the caller reads it and calls `next` again
    done,       ///< the conversation has ended
  };

  Kind kind = Kind::wait;  ///< requested action
  ExtraWire wire{};        ///< pulse: the wire to drive
  bool hold_low = false;   ///< transfer on a clocked link: the clock line, which idles high, is held low until `at`
  /// Transfer on a line of characters: `out` is sent in frames of this number of items, with a pause of `width` between
  /// two of them; 0: in one piece.
  std::uint8_t frame = 0;
  std::span<const Item> out{};  ///< transfer: items to send; valid until the next feed
  std::size_t expect = 0;       ///< transfer, wait: number of items still expected; 0: unknown, or none
  /// Transfer on a clocked link: number of clocks. A device that drives more bits than hosts read sets the number of
  /// bits that hosts read.
  std::size_t bits = 0;
  std::uint32_t rate = 0;  ///< configure: new rate in bits per second
  Time at{};  ///< transfer, pulse: earliest time to begin; wait: time of the `timer` event, if it is in the future
  /// Transfer, wait: `silence` is reported when nothing is received for this time after `sent`; 0: no limit.
  Time answer{};
  Time gap{};  ///< transfer, wait: `silence` is reported when the line is quiet this long after an item; 0: no limit
  /// Pulse: its duration. Transfer in frames: pause between two of them. Transfer of a device on a clocked link: after
  /// `out` the device drives the data line low until this time after the last clock edge.
  Time width{};

  /// Transfer of a device on an SPI or clocked link: returns the byte that the host samples after `out` has ended, 0x00
  /// if the device then drives the line low (`width` is not 0), else 0xFF, because an undriven line is pulled up.
  [[nodiscard]] constexpr std::uint8_t behind_out() const { return width > Time{} ? 0x00 : 0xFF; }
};

/// An event on the line. `at` is the time of its completion: for bits on the line, the end of the last one.
///
/// A clocked device gets the period of the clock in `selected`, because its reply depends on it: the ACK of BiSS, and
/// the delay of a long line. An SPI device gets the period in `sent`: a pause lies between chip select and the first
/// clock, so the time since `selected` does not give the clock rate.
template <class Item>
struct Event {
  /// Kinds of events at a port.
  enum class Kind : std::uint8_t {
    sent,      ///< the transfer is complete (device side of spi and clocked: the host has stopped clocking)
    received,  ///< `items` were received from the line
    silence,   ///< the `answer` or `gap` limit of the last step has passed
    timer,     ///< the time `at` of the last wait step was reached
    /// Device side: chip select or first clock edge. The next step should be the reply that the device drives.
    selected,
    triggered,  ///< device side: a pulse on `wire` has begun
    /// A damaged character (stop bit, parity, other rate) or CAN frame was received, or a CAN frame could not be sent.
    line_error,
  };

  Kind kind = Kind::timer;        ///< kind of the event
  Time at{};                      ///< time at which the event was complete
  std::span<const Item> items{};  ///< received: the items that were received; valid during the call
  std::size_t bits = 0;           ///< sent, device side of a clocked link: number of clocks counted
  ExtraWire wire{};               ///< triggered: the wire of the pulse
  bool held_low = false;  ///< selected on a clocked link: the clock line was held low before the transfer, not idle
  bool idle_low = false;  ///< received on a clocked link: the data line was low already before the first bit
  /// Triggered: duration of the pulse. Device side, selected on a clocked link and sent on an SPI link: the period of
  /// the clock, 0 if not known.
  Time width{};
  Time lead{};  ///< sent, device side of an SPI link: time from chip select to the first clock
  /// Uncertainty of `at`. received: `items` may have arrived earlier by up to this time, because the port could not
  /// look sooner; sent: the transfer may have ended earlier by up to this time; 0: none, or not known.
  Time late{};
};

/// A protocol's side of a conversation. At the start and after each `feed`, call `next` until it returns `wait` or
/// `done`. Call both from one context: interrupts must queue events.
template <class Item>
struct Machine {
  /// Processes an event that the port reports.
  virtual void feed(const Event<Item>& event) = 0;
  /// Returns the next step that the port must carry out.
  virtual Step<Item> next(Time now) = 0;

 protected:
  ~Machine() = default;  // a public virtual destructor would link operator delete
};

/// A step on a line of bytes.
using ByteStep = Step<std::uint8_t>;
/// An event on a line of bytes.
using ByteEvent = Event<std::uint8_t>;

}  // namespace absenc
