// SPDX-License-Identifier: Apache-2.0
// Firmware that reads one position after the other and nothing else: what of the library it links is measured. Its
// registers stand for a UART, an SPI or a CAN controller.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>

#include "absenc/link/can.hpp"
#include "absenc/link/step.hpp"

namespace absenc::firmware {

struct Registers {
  std::uint32_t data;
  std::uint32_t has_data;
  std::uint32_t nanoseconds;
  std::uint32_t singleturn;
  std::uint32_t multiturn;
  std::uint32_t error;
};
inline volatile Registers registers{};

inline std::uint8_t receive(std::uint8_t) { return static_cast<std::uint8_t>(registers.data); }
inline CanFrame receive(const CanFrame&) {
  CanFrame frame{.id = registers.data, .size = 8};
  for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(registers.data);
  return frame;
}
inline void send(std::uint8_t byte) { registers.data = byte; }
inline void send(const CanFrame& frame) {
  registers.data = frame.id;
  for (const std::uint8_t byte : frame.data) registers.data = byte;
}

/// One position: `machine` is driven to its end.
template <class Item, class Reader>
void read(Reader& machine) {
  using Kind = typename Event<Item>::Kind;
  for (;;) {
    const Time now{registers.nanoseconds};
    const Step<Item> step = machine.next(now);
    Event<Item> event{.kind = Kind::timer, .at = now};
    Item item{};
    if (step.kind == Step<Item>::Kind::done || step.kind == Step<Item>::Kind::emit) {
      if (const auto* reading = machine.reading()) {
        registers.singleturn = static_cast<std::uint32_t>(reading->singleturn);
        registers.multiturn = static_cast<std::uint32_t>(reading->multiturn);
      }
      registers.error = static_cast<std::uint32_t>(machine.error());
      return;
    }
    if (step.kind == Step<Item>::Kind::transfer) {
      for (const Item& one : step.out) send(one);
      event.kind = Kind::sent;
    } else if (registers.has_data != 0) {
      item = receive(Item{});
      event.kind = Kind::received;
      event.items = {&item, 1};
    } else if (step.answer != Time{} || step.gap != Time{}) {
      event.kind = Kind::silence;
    }
    machine.feed(event);
  }
}

/// For ever, in memory that is counted.
template <class Item, class Reader, class... Parameters>
[[noreturn]] void run(const Parameters&... parameters) {
  alignas(Reader) static std::byte memory[sizeof(Reader)];
  for (;;) read<Item>(*new (memory) Reader(parameters...));
}

}  // namespace absenc::firmware
