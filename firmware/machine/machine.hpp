// SPDX-License-Identifier: Apache-2.0
// Interface of the programs to their machine: a clock with a tick, one UART, and the emulator.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"

namespace absenc::machine {

/// Prints a text or a decimal number on the emulator's terminal.
void print(std::string_view text);
void print(std::uint64_t number);
/// Ends the emulator with status 0 if `good`, otherwise 1.
[[noreturn]] void end(bool good);
/// Returns the number in the emulator's argument `index`, from 0 on; `otherwise` if there is none.
[[nodiscard]] std::uint32_t argument(unsigned index, std::uint32_t otherwise);

/// Starts the clock. From now on `on_tick` is called once per `period`, which is at most 0.5 s.
void start_clock(Time period);
/// Returns the time since `start_clock`, with a resolution below one microsecond.
[[nodiscard]] Time now();

/// Starts a timer that calls `on_alarm` once after `delay`, at most 1 s. A second call before that replaces the delay.
void set_alarm(Time delay);

/// Starts the UART: from now on it calls `on_received` and `on_sent`.
void start_uart();
/// Sends `bytes` by interrupts; they must stay valid until `on_sent` is called.
void send(Bytes bytes);

/// Returns the largest size of the stack since `paint_stack`, in bytes.
[[nodiscard]] std::size_t stack_used();
/// Restarts the measurement of `stack_used`.
void paint_stack();

/// Disables interrupts while an object of this class exists. Locks must not be nested.
class InterruptLock {
 public:
  InterruptLock() { asm volatile("cpsid i" : : : "memory"); }
  ~InterruptLock() { asm volatile("cpsie i" : : : "memory"); }
  InterruptLock(const InterruptLock&) = delete;
  InterruptLock& operator=(const InterruptLock&) = delete;
};

// ---- Functions that the program provides; all interrupts have one priority

void on_tick();
void on_alarm();
void on_received(std::uint8_t byte);
/// Called when the last bit of the bytes given to `send` is on the line.
void on_sent();

// ---- Functions that the machine provides; virt.cpp has only the first one

/// Calls the emulator's semihosting service `number` and returns its result.
std::uint32_t call_emulator(std::uint32_t number, const void* parameter);

/// Frequency of the clock that SysTick counts: in hertz, and as an exact ratio of counts to nanoseconds.
struct Frequency {
  std::uint32_t hertz;
  std::uint32_t nanoseconds;  // time that the number of counts in `counts` takes, in nanoseconds
  std::uint32_t counts;
};
extern const Frequency frequency;
void handle_uart();
void handle_alarm();
inline constexpr unsigned alarm_number = 8;  ///< Interrupt of the timer that `set_alarm` starts.

/// Returns a reference to the machine's register at `address`.
inline volatile std::uint32_t& register_at(std::uint32_t address) {
  return *reinterpret_cast<volatile std::uint32_t*>(address);
}

}  // namespace absenc::machine
