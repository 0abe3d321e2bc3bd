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

// ---- Timer (nRF51 Series Reference Manual, 18)

namespace {
constexpr std::uint32_t timer = 0x4000'8000;
constexpr std::uint32_t timer_start = timer, timer_stop = timer + 0x004, timer_clear = timer + 0x00C,
                        timer_compared = timer + 0x140, timer_interrupts = timer + 0x304, timer_width = timer + 0x508,
                        timer_prescaler = timer + 0x510, timer_compare = timer + 0x540;
constexpr std::uint32_t compare_bit = 1u << 16, width_of_32_bits = 3;
}  // namespace

void set_alarm(Time delay) {
  const auto counts = static_cast<std::uint32_t>(delay.count()) / frequency.nanoseconds * frequency.counts;
  register_at(timer_stop) = 1;
  register_at(timer_clear) = 1;
  register_at(timer_compared) = 0;
  register_at(timer_width) = width_of_32_bits;
  register_at(timer_prescaler) = 0;
  register_at(timer_compare) = counts > 0 ? counts : 1;
  register_at(timer_interrupts) = compare_bit;
  register_at(set_enable) = 1u << alarm_number;
  register_at(timer_start) = 1;
}

void handle_alarm() {
  register_at(timer_stop) = 1;
  register_at(timer_compared) = 0;
  on_alarm();
}

// ---- UART

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
  // If the handler runs late, it finds a received byte and the end of a transmission; it must handle the end of the
  // transmission first.
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
