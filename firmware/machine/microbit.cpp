// SPDX-License-Identifier: Apache-2.0
// The machine micro:bit: Cortex-M0, nRF51822 (UART: nRF51 Series Reference Manual, 29). The real part has no SysTick.
#include "firmware/machine/machine.hpp"

namespace absenc::machine {

namespace {
constexpr std::uint32_t uart = 0x4000'2000;
constexpr std::uint32_t start_receiver = uart + 0x000, start_transmitter = uart + 0x008, received = uart + 0x108,
                        sent = uart + 0x11C, enable_interrupts = uart + 0x304, enable = uart + 0x500,
                        data_in = uart + 0x518, data_out = uart + 0x51C, set_enable = 0xE000'E100;
constexpr std::uint32_t received_bit = 1u << 2, sent_bit = 1u << 7, uart_number = 2;

Bytes unsent{};  // bytes whose transmission has not ended; the first one is in the transmitter
}  // namespace

const Frequency frequency{16'000'000, 125, 2};

void start_uart() {
  register_at(enable) = 4;
  register_at(start_receiver) = 1;
  register_at(start_transmitter) = 1;
  register_at(enable_interrupts) = received_bit | sent_bit;
  register_at(set_enable) = 1u << uart_number;
}

void send(Bytes bytes) {
  unsent = bytes;
  register_at(data_out) = unsent[0];
}

void handle_uart() {
  // A late handler finds both events and must handle the end of transmission first.
  const bool has_received = register_at(received) != 0;
  while (register_at(sent) != 0) {
    register_at(sent) = 0;
    if (!unsent.empty()) unsent = unsent.subspan(1);
    if (unsent.empty()) {
      on_sent();
    } else {
      register_at(data_out) = unsent[0];
    }
  }
  if (has_received) {
    register_at(received) = 0;
    on_received(static_cast<std::uint8_t>(register_at(data_in)));
  }
}

}  // namespace absenc::machine
