// SPDX-License-Identifier: Apache-2.0
// The machines MPS2 with the images AN385 (Cortex-M3) and AN386 (Cortex-M4F), and their UART.
#include "firmware/machine/machine.hpp"

namespace absenc::machine {

namespace {
constexpr std::uint32_t uart = 0x4000'4000;
constexpr std::uint32_t data = uart, state = uart + 0x04, control = uart + 0x08, pending = uart + 0x0C,
                        divider = uart + 0x10, set_enable = 0xE000'E100;
constexpr std::uint32_t receiver_is_full = 2, sent_bit = 1, received_bit = 2;
constexpr std::uint32_t receiver_number = 0, transmitter_number = 1;

Bytes unsent{};  // bytes whose transmission has not ended; the first one is in the transmitter
}  // namespace

const Frequency frequency{25'000'000, 40, 1};

// ---- Timer

namespace {
constexpr std::uint32_t timer = 0x4000'0000;
constexpr std::uint32_t timer_control = timer, timer_value = timer + 0x04, timer_reload = timer + 0x08,
                        timer_pending = timer + 0x0C;
}  // namespace

void set_alarm(Time delay) {
  const auto counts = static_cast<std::uint32_t>(delay.count()) / frequency.nanoseconds;
  register_at(timer_control) = 0;
  register_at(timer_reload) = ~std::uint32_t{0};
  register_at(timer_value) = counts > 0 ? counts : 1;
  register_at(timer_control) = 9;  // bit 0 enables the timer, bit 3 its interrupt
  register_at(set_enable) = 1u << alarm_number;
}

void handle_alarm() {
  register_at(timer_control) = 0;
  register_at(timer_pending) = 1;
  on_alarm();
}

// ---- UART

void start_uart() {
  register_at(divider) = 16;
  register_at(control) = 0xF;  // bits 0 to 3 enable the transmitter, the receiver and the interrupts of both
  register_at(set_enable) = 1u << receiver_number | 1u << transmitter_number;
}

void send(Bytes bytes) {
  unsent = bytes;
  register_at(data) = unsent[0];
}

void handle_uart() {
  // If the handler runs late, it finds a received byte and the end of a transmission; it must handle the end of the
  // transmission first.
  for (;;) {
    const bool has_received = (register_at(state) & receiver_is_full) != 0;
    while ((register_at(pending) & sent_bit) != 0) {
      register_at(pending) = sent_bit;
      if (!unsent.empty()) unsent = unsent.subspan(1);
      if (unsent.empty()) {
        on_sent();
      } else {
        register_at(data) = unsent[0];
      }
    }
    if (!has_received) return;
    register_at(pending) = received_bit;
    on_received(static_cast<std::uint8_t>(register_at(data)));
  }
}

}  // namespace absenc::machine
