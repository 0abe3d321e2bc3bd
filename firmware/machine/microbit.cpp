// SPDX-License-Identifier: Apache-2.0
// The micro:bit: Cortex-M0, nRF51822 (UART: nRF51 Series Reference Manual, 29). The real part has no SysTick; the
// emulated one has, at 16 MHz.
#include "firmware/machine/machine.hpp"

namespace absenc::machine {

namespace {
constexpr std::uint32_t uart = 0x4000'2000;
constexpr std::uint32_t start_receiver = uart + 0x000, start_transmitter = uart + 0x008, received = uart + 0x108,
                        sent = uart + 0x11C, enable_interrupts = uart + 0x304, enable = uart + 0x500,
                        data_in = uart + 0x518, data_out = uart + 0x51C, set_enable = 0xE000'E100;
constexpr std::uint32_t received_bit = 1u << 2, sent_bit = 1u << 7, uart_number = 2;

Bytes going{};  // the first byte is in the transmitter
}  // namespace

const Frequency frequency{16'000'000, 125, 2};

void start_uart() {
  at(enable) = 4;
  at(start_receiver) = 1;
  at(start_transmitter) = 1;
  at(enable_interrupts) = received_bit | sent_bit;
  at(set_enable) = 1u << uart_number;
}

void send(Bytes bytes) {
  going = bytes;
  at(data_out) = going[0];
}

void handle_uart() {
  // Whoever is late to look finds both, and what was sent comes first. Looked for the other way round: what is received
  // after the first look may be the answer to what is sent after the second.
  const bool has_received = at(received) != 0;
  while (at(sent) != 0) {
    at(sent) = 0;
    if (!going.empty()) going = going.subspan(1);
    if (going.empty()) {
      on_sent();
    } else {
      at(data_out) = going[0];
    }
  }
  if (has_received) {
    at(received) = 0;
    on_received(static_cast<std::uint8_t>(at(data_in)));
  }
}

}  // namespace absenc::machine
