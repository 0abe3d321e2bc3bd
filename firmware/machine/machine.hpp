// SPDX-License-Identifier: Apache-2.0
// What the programs here know of the machine they run on: a clock that ticks, one UART, and QEMU for words and the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"

namespace absenc::machine {

/// Prints on the terminal of the emulator; numbers are decimal.
void say(std::string_view text);
void say(std::uint64_t number);
/// Ends the emulator with status 0 or 1.
[[noreturn]] void end(bool good);
/// The number that is the emulator's argument `index`, 0 the first behind the program's name; `otherwise` without one.
[[nodiscard]] std::uint32_t argument(unsigned index, std::uint32_t otherwise);

/// From here on `on_tick` is called every `period`, at most 0.5 s.
void start_clock(Time period);
/// Since `start_clock`, to a fraction of a microsecond. From interrupts as from the main program.
[[nodiscard]] Time now();

/// From here on `on_received` and `on_sent` are called.
void start_uart();
/// Sends by interrupts; `bytes` must stay until `on_sent`.
void send(Bytes bytes);

/// The most that the stack has taken since the start, bytes.
[[nodiscard]] std::size_t stack_used();
/// Only what was paid from here on counts.
void paint_stack();

/// While one lives, no interrupt comes.
class Quiet {
 public:
  Quiet() { asm volatile("cpsid i" : : : "memory"); }
  ~Quiet() { asm volatile("cpsie i" : : : "memory"); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;
};

// ---- What a program has; all interrupts have one priority, so that none comes into another

void on_tick();
void on_received(std::uint8_t byte);
/// The last bit of what was sent is out.
void on_sent();

// ---- What each machine has: cortex_m.cpp with microbit.cpp or mps2.cpp; virt.cpp, which has the first alone

/// Semihosting: asks the emulator for its service `number`.
std::uint32_t call_emulator(std::uint32_t number, const void* parameter);

/// Of the clock that SysTick counts.
struct Frequency {
  std::uint32_t hertz;
  std::uint32_t nanoseconds;  // of `counts` counts
  std::uint32_t counts;
};
extern const Frequency frequency;
void handle_uart();

/// A register of the machine.
inline volatile std::uint32_t& at(std::uint32_t address) { return *reinterpret_cast<volatile std::uint32_t*>(address); }

}  // namespace absenc::machine
