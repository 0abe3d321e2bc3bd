// SPDX-License-Identifier: Apache-2.0
// A drive with a T-format encoder, as in docs/drive.md.
#include <chrono>
#include <cstdint>
#include <new>

#include "absenc/host/carrier.hpp"
#include "absenc/host/cyclic_host.hpp"
#include "absenc/host/extrapolation.hpp"
#include "absenc/protocol/tformat/host.hpp"

using namespace absenc;
using namespace std::chrono_literals;

Time now();                   // you write this: returns the time since start, from a counter that never stops
void uart_send(Bytes bytes);  // you write this: switches the RS-485 driver on, starts sending, and returns at once
void stop_the_drive();        // you write this: it is called when the position is too old

struct Axis {
  static constexpr tformat::Format format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11};
  static constexpr Time period = 100us;           // period of the current loop
  static constexpr std::uint32_t pole_pairs = 4;  // number of pole pairs of the motor
  // electrical angle at position 0, in 2^-32 turn; you measure it once
  static constexpr std::uint32_t offset = 0x4000'0000;
  static constexpr std::uint32_t most_stale = 3;  // after more cycles than this without a position, the drive stops

  struct Read {
    Conversation<std::uint8_t>& operator()() { return *new (memory) tformat::ReadPosition(format); }
    alignas(tformat::ReadPosition) std::byte memory[sizeof(tformat::ReadPosition)];
  };
  Read read;
  host::CyclicHost<std::uint8_t, Read&> cycles{
      read, {.period = period, .line = tformat::line_settings, .answer = 12us}, period};
  host::Carrier<std::uint8_t, Axis> carrier{*this, 4us};  // latency of the UART: one character
  host::Extrapolation extrapolation;

  // The carrier calls `begin` and `result`.
  void begin(const ByteStep& step) { uart_send(step.out); }
  void result(bool) {
    const host::Cycle& cycle = cycles.cycle();
    if (cycle.kind == host::Cycle::Kind::fresh) extrapolation.add(cycle.reading);
    if (cycle.stale > most_stale) stop_the_drive();
  }

  // Returns the electrical angle at `time`, in 2^-32 turn.
  [[nodiscard]] std::uint32_t electrical_angle(Time time) const {
    const auto turn = static_cast<std::uint32_t>(extrapolation.at(time) << (32 - format.singleturn_bits));
    return turn * pole_pairs + offset;
  }
} axis;

void start() { axis.carrier.start(axis.cycles, now()); }
// call this when the time axis.carrier.due() is reached, or every few microseconds
void timer_tick() { axis.carrier.tick(now()); }
void uart_byte_received(std::uint8_t byte) { axis.carrier.received({&byte, 1}, now()); }
void uart_transmission_complete() { axis.carrier.sent(now()); }  // before this call, switch the RS-485 driver off

// Called in each cycle of the current loop: returns the angle at the instant at which its voltages take effect.
std::uint32_t control_cycle(Time instant) {
  if (!axis.extrapolation.valid()) stop_the_drive();
  return axis.electrical_angle(instant);
}
