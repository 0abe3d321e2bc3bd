// SPDX-License-Identifier: Apache-2.0
// ARM's MPS2 boards with the images AN385 (Cortex-M3) and AN386 (Cortex-M4F), and their CMSDK UART.
#include "firmware/machine/machine.hpp"

namespace absenc::machine {

namespace {
constexpr std::uint32_t uart = 0x4000'4000;
constexpr std::uint32_t data = uart, state = uart + 0x04, control = uart + 0x08, pending = uart + 0x0C,
                        divider = uart + 0x10, set_enable = 0xE000'E100;
constexpr std::uint32_t receiver_is_full = 2, sent_bit = 1, received_bit = 2;
constexpr std::uint32_t receiver_number = 0, transmitter_number = 1;

Bytes going{};  // the first byte is in the transmitter
}  // namespace

const Frequency frequency{25'000'000, 40, 1};

void start_uart() {
  at(divider) = 16;
  at(control) = 0xF;  // transmitter, receiver, and an interrupt of each
  at(set_enable) = 1u << receiver_number | 1u << transmitter_number;
}

void send(Bytes bytes) {
  going = bytes;
  at(data) = going[0];
}

void handle_uart() {
  // Whoever is late to look finds both, and what was sent comes first. Looked for the other way round: what is received
  // after the first look may be the answer to what is sent after the second.
  for (;;) {
    const bool has_received = (at(state) & receiver_is_full) != 0;
    while ((at(pending) & sent_bit) != 0) {
      at(pending) = sent_bit;
      if (!going.empty()) going = going.subspan(1);
      if (going.empty()) {
        on_sent();
      } else {
        at(data) = going[0];
      }
    }
    if (!has_received) return;
    at(pending) = received_bit;
    on_received(static_cast<std::uint8_t>(at(data)));
  }
}

}  // namespace absenc::machine
