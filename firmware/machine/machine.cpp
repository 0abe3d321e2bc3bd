// SPDX-License-Identifier: Apache-2.0
#include "firmware/machine/machine.hpp"

#include <algorithm>
#include <array>

extern "C" std::uint32_t bss_end, stack_top;

namespace absenc::machine {

// ---- Semihosting: a breakpoint that the emulator takes for a call

namespace {

enum Call : std::uint32_t { write_text = 0x04, get_arguments = 0x15, exit_with_status = 0x20 };

std::uint32_t call(Call number, const void* parameter) {
  register std::uint32_t r0 asm("r0") = number;
  register const void* r1 asm("r1") = parameter;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

}  // namespace

void say(std::string_view text) {
  std::array<char, 64> piece;
  while (!text.empty()) {
    const std::size_t size = std::min(text.size(), piece.size() - 1);
    std::copy_n(text.begin(), size, piece.begin());
    piece[size] = 0;
    call(write_text, piece.data());
    text.remove_prefix(size);
  }
}

void say(std::uint64_t number) {
  std::array<char, 20> digits;
  std::size_t at = digits.size();
  do {
    digits[--at] = static_cast<char>('0' + number % 10);
    number /= 10;
  } while (number != 0);
  say({digits.data() + at, digits.size() - at});
}

void end(bool good) {
  const std::array<std::uint32_t, 2> reason{0x20026, good ? 0u : 1u};  // the application ends, with a status
  call(exit_with_status, reason.data());
  for (;;) {
  }
}

std::uint32_t argument(unsigned index, std::uint32_t otherwise) {
  std::array<char, 128> text{};
  struct {
    char* text;
    std::uint32_t size;
  } block{text.data(), text.size()};
  if (call(get_arguments, &block) != 0) return otherwise;
  const char* one = text.data();
  for (unsigned i = 0; i <= index; ++i) {  // what is in front is the program
    while (*one != ' ' && *one != 0) ++one;
    while (*one == ' ') ++one;
  }
  if (*one < '0' || *one > '9') return otherwise;
  std::uint32_t number = 0;
  for (; *one >= '0' && *one <= '9'; ++one) number = 10 * number + static_cast<std::uint32_t>(*one - '0');
  return number;
}

// ---- SysTick

namespace {
constexpr std::uint32_t control = 0xE000'E010, reload = 0xE000'E014, value = 0xE000'E018, interrupts = 0xE000'ED04;
constexpr std::uint32_t tick_is_pending = 1u << 26;

std::uint32_t counts_of_period = 0;
Time period_of_ticks{};
Time begin_of_tick{};  // the begin of this period; written by the tick alone
}  // namespace

void start_clock(Time period) {
  period_of_ticks = period;
  counts_of_period = static_cast<std::uint32_t>(period.count()) / frequency.nanoseconds * frequency.counts;
  at(reload) = counts_of_period - 1;
  at(value) = 0;
  at(control) = 7;  // the processor's clock, with interrupts
}

Time now() {
  std::uint32_t masked;
  asm volatile("mrs %0, primask\ncpsid i" : "=r"(masked) : : "memory");
  std::uint32_t left = at(value);
  Time begin = begin_of_tick;
  if ((at(interrupts) & tick_is_pending) != 0) {  // it has begun anew, and nobody has counted it yet
    left = at(value);
    begin += period_of_ticks;
  }
  asm volatile("msr primask, %0" : : "r"(masked) : "memory");
  return begin + Time((counts_of_period - 1 - left) * frequency.nanoseconds / frequency.counts);
}

extern "C" void tick() {
  begin_of_tick += period_of_ticks;
  on_tick();
}

// ---- The stack, painted below where it stands

namespace {
constexpr std::uint32_t paint = 0xA5A5'A5A5;
}

[[gnu::noinline]] void paint_stack() {
  const auto* const here = static_cast<std::uint32_t*>(__builtin_frame_address(0));
  for (volatile std::uint32_t* one = &bss_end; one < here - 16; ++one) *one = paint;
}

std::size_t stack_used() {
  const volatile std::uint32_t* lowest = &bss_end;
  while (lowest != &stack_top && *lowest == paint) ++lowest;
  return static_cast<std::size_t>(&stack_top - lowest) * sizeof paint;
}

}  // namespace absenc::machine
