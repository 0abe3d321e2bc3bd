// SPDX-License-Identifier: Apache-2.0
// Common parts of the Cortex-M machines: vectors, SysTick, calls of the emulator.
#include <array>

#include "firmware/machine/machine.hpp"

extern "C" {
extern std::uint32_t stack_top;
[[noreturn]] void start();
[[noreturn]] void fault();
void tick();
void uart() { absenc::machine::handle_uart(); }
void alarm() { absenc::machine::handle_alarm(); }
}

namespace {

struct Vectors {
  std::uint32_t* stack;
  void (*reset)();
  std::array<void (*)(), 13> faults;
  void (*tick)();
  std::array<void (*)(), 32> devices;
};

constexpr auto filled = []<std::size_t count>(std::array<void (*)(), count> all, void (*with)()) {
  for (auto& one : all) one = with;
  return all;
};

// Vectors of all device interrupts. Only those of the UART and of one timer are ever enabled.
constexpr auto devices = [] {
  auto all = filled(std::array<void (*)(), 32>{}, uart);
  all[absenc::machine::alarm_number] = alarm;
  return all;
}();

[[gnu::section(".vectors"), gnu::used]] const Vectors vectors{
    &stack_top, start, filled(std::array<void (*)(), 13>{}, fault), tick, devices};

}  // namespace

namespace absenc::machine {

[[gnu::weak]] void on_alarm() {}

std::uint32_t call_emulator(std::uint32_t number, const void* parameter) {
  register std::uint32_t r0 asm("r0") = number;
  register const void* r1 asm("r1") = parameter;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

// ---- SysTick

namespace {
constexpr std::uint32_t control = 0xE000'E010, reload = 0xE000'E014, value = 0xE000'E018, interrupts = 0xE000'ED04;
constexpr std::uint32_t tick_is_pending = 1u << 26;

std::uint32_t counts_of_period = 0;
Time period_of_ticks{};
Time begin_of_tick{};  // start of the present period of the tick; only the tick's interrupt writes it
}  // namespace

void start_clock(Time period) {
  period_of_ticks = period;
  counts_of_period = static_cast<std::uint32_t>(period.count()) / frequency.nanoseconds * frequency.counts;
  register_at(reload) = counts_of_period - 1;
  register_at(value) = 0;
  register_at(control) = 7;  // SysTick counts the processor clock, and its interrupt is enabled
  // The counter is 0 until it takes the value of `reload`; `now` would take that for the end of the first period.
  while (register_at(value) == 0) {
  }
}

Time now() {
  std::uint32_t masked;
  asm volatile("mrs %0, primask\ncpsid i" : "=r"(masked) : : "memory");
  std::uint32_t left = register_at(value);
  Time begin = begin_of_tick;
  // the counter has restarted, but the interrupt of the tick has not run yet
  if ((register_at(interrupts) & tick_is_pending) != 0) {
    left = register_at(value);
    if (left == 0) left = counts_of_period - 1;  // the counter is 0 until it takes the value of `reload`
    begin += period_of_ticks;
  }
  asm volatile("msr primask, %0" : : "r"(masked) : "memory");
  return begin + Time((counts_of_period - 1 - left) * frequency.nanoseconds / frequency.counts);
}

extern "C" void tick() {
  begin_of_tick += period_of_ticks;
  on_tick();
}

}  // namespace absenc::machine
