// SPDX-License-Identifier: Apache-2.0
// A T-format encoder read from interrupts, as in docs/firmware.md.
#include <chrono>
#include <cstdint>
#include <optional>

#include "absenc/host/carrier.hpp"
#include "absenc/protocol/tformat/host.hpp"

using namespace absenc;

Time now();                   // yours: time since start, from a counter that never stops
void uart_send(Bytes bytes);  // yours: switches the RS-485 driver on, starts sending, returns at once

struct Encoder {
  static constexpr tformat::Format format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11};
  struct Read final : tformat::ReadPosition {
    using ReadPosition::ReadPosition;
  };
  std::optional<Read> read;
  host::Carrier<std::uint8_t, Encoder> carrier{*this, std::chrono::microseconds(4)};  // latency of one character
  std::uint64_t position = 0;  // counts, from the last good reading

  void begin(const ByteStep& step) { uart_send(step.out); }
  void result(bool finished) {
    if (!finished) return;
    if (read->error() != Error::none) return;  // position stays as it was
    if (read->reading()->singleturn_valid()) position = read->reading()->singleturn;
  }
} encoder;

void control_cycle() {  // from a timer: requests one position a cycle
  if (encoder.carrier.is_busy()) return;
  encoder.carrier.start(encoder.read.emplace(Encoder::format), now());
}
void uart_byte_received(std::uint8_t byte) { encoder.carrier.received({&byte, 1}, now()); }
void uart_transmission_complete() { encoder.carrier.sent(now()); }  // first switch the RS-485 driver off
void timer_tick() { encoder.carrier.tick(now()); }                  // every 10 us or so: notices a missing reply
