// SPDX-License-Identifier: Apache-2.0
// A T-format encoder read from interrupts, as in docs/firmware.md.
#include <chrono>
#include <cstdint>
#include <optional>

#include "absenc/host/carrier.hpp"
#include "absenc/protocol/tformat/host.hpp"

using namespace absenc;

Time now();                   // you write this: returns the time since start, from a counter that never stops
void uart_send(Bytes bytes);  // you write this: switches the RS-485 driver on, starts sending, and returns at once

struct Encoder {
  static constexpr tformat::Format format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11};
  struct Read final : tformat::ReadPosition {
    using ReadPosition::ReadPosition;
  };
  std::optional<Read> read;
  // latency of the UART: one character
  host::Carrier<std::uint8_t, Encoder> carrier{*this, std::chrono::microseconds(4)};
  std::uint64_t position = 0;  // position of the last good reading, in counts

  void begin(const ByteStep& step) { uart_send(step.out); }
  void result(bool finished) {
    if (!finished) return;
    if (read->error() != Error::none) return;  // after an error, `position` stays as it was
    if (read->reading()->singleturn_valid()) position = read->reading()->singleturn;
  }
} encoder;

void control_cycle() {  // a timer calls this, to request one position in each cycle
  if (encoder.carrier.is_busy()) return;
  encoder.carrier.start(encoder.read.emplace(Encoder::format), now());
}
void uart_byte_received(std::uint8_t byte) { encoder.carrier.received({&byte, 1}, now()); }
void uart_transmission_complete() { encoder.carrier.sent(now()); }  // before this call, switch the RS-485 driver off
void timer_tick() { encoder.carrier.tick(now()); }  // call this about every 10 us: it notices a missing reply
