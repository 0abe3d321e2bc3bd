// SPDX-License-Identifier: Apache-2.0
// The conversation between a protocol and whatever carries it: a machine is fed events and asked for steps.
// It owns no port and no clock, so the same object runs over a real port, on a microcontroller and in virtual time.
// Not in core, because it speaks of lines and CAN frames, which core does not know.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/core/time.hpp"
#include "absenc/link/can.hpp"
#include "absenc/link/line.hpp"

namespace absenc {

/// What a machine wants next. Times are protocol time: the carrier adds its own latency to `answer` and `gap`.
/// Item is std::uint8_t (characters, SPI bytes, clocked bits packed MSB first) or CanFrame.
///
/// A transfer is handed out once; after it the machine waits. `expect`, `answer` and `gap` stand in both steps: in the
/// transfer because a microcontroller must prepare its receiver before the last bit is out, in the wait because they
/// change while items come. A machine that may be fed another event in the very moment of its timer compares the time
/// in `next` itself.
template <class Item>
struct Step {
  enum class Kind : std::uint8_t {
    wait,       // until the next event
    transfer,   // not before `at`: send `out` (spi: and receive max(out, expect) items; clocked: clock `bits`)
    pulse,      // not before `at`: drive `wire` active for `width`
    configure,  // switch this end of the line to `rate`; all else stays as it is
    emit,       // a result is ready to be looked at; ask again
    done,       // the conversation is over
  };

  Kind kind = Kind::wait;
  ExtraWire wire{};             // pulse
  bool hold_low = false;        // transfer on a clocked link: until `at` the clock line, which idles high, is held low
  std::span<const Item> out{};  // valid until the next feed
  std::size_t expect = 0;       // transfer, wait: items still due; 0: unknown, or none
  std::size_t bits = 0;         // transfer on a clocked link: number of clocks; of the device: that hosts take, if it
                                // drives more
  std::uint32_t rate = 0;       // configure: bits a second
  Time at{};                    // transfer, pulse: not before; wait: a `timer` event is due then, if that lies ahead
  Time answer{};                // transfer, wait: `silence` when nothing has come this long after `sent`; 0: no limit
  Time gap{};    // transfer, wait: `silence` when the line was quiet this long after an item; 0: no limit
  Time width{};  // pulse; transfer of the device on a clocked link: behind `out`, and for so long after the last edge
                 // of the clock, it drives the data line low

  /// transfer of the device on an SPI or clocked link: what the host samples behind `out`. A line that nobody drives is
  /// pulled up.
  [[nodiscard]] constexpr std::uint8_t behind_out() const { return width > Time{} ? 0x00 : 0xFF; }
};

/// What happened. `at` is the time at which it was complete: the end of the last bit.
///
/// A clocked device is told the period of the clock with `selected`, because what it answers depends on it: the ACK of
/// BiSS, and what a long line makes of it. An SPI device is told with `sent`: between chip select and the first clock
/// there is a pause, so that the time since `selected` does not tell how fast it was.
template <class Item>
struct Event {
  enum class Kind : std::uint8_t {
    sent,        // the transfer has left (spi and clocked, device side: the host has stopped clocking)
    received,    // `items` came
    silence,     // the `answer` or `gap` limit of the last step has passed
    timer,       // the `at` of the last wait has come
    selected,    // device side: chip select or first clock edge; the next step should be what it drives
    triggered,   // device side: a pulse on `wire` has begun
    line_error,  // a character with a wrong stop or parity bit, or sent at another rate, came
  };

  Kind kind = Kind::timer;
  Time at{};
  std::span<const Item> items{};  // received: valid during the call
  std::size_t bits = 0;           // sent, device side of a clocked link: number of clocks seen
  ExtraWire wire{};               // triggered
  bool held_low = false;          // selected on a clocked link: the clock line was held low before it, not idle
  bool idle_low = false;          // received on a clocked link: the data line was low before the first bit, too
  Time width{};                   // triggered: how long the pulse lasts; device side, selected on a clocked link and
                                  // sent on an SPI link: the period of the clock; 0: not known
  Time lead{};                    // sent, device side of an SPI link: from chip select to the first clock
  Time late{};                    // received: `items` may have come so much earlier, because the carrier was kept from
                                  // looking; sent: the transfer may have ended so much earlier, because the carrier
                                  // was kept from noting it; 0: not, or not known
};

/// After each `feed`, call `next` until it returns `wait` or `done`. Both in one context: interrupts queue events.
template <class Item>
struct Machine {
  virtual void feed(const Event<Item>& event) = 0;
  virtual Step<Item> next(Time now) = 0;

 protected:
  ~Machine() = default;  // a public virtual destructor would link operator delete
};

using ByteStep = Step<std::uint8_t>;
using ByteEvent = Event<std::uint8_t>;

}  // namespace absenc
