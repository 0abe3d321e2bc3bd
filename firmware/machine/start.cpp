// SPDX-License-Identifier: Apache-2.0
// From reset to main, and the interrupts: the same on every Cortex-M. A part's own start-up takes its place.
#include <array>

#include "firmware/machine/machine.hpp"

int main();

extern "C" {
extern std::uint32_t data_load, data_begin, data_end, bss_begin, bss_end, stack_top;
using Constructor = void (*)();
extern const Constructor constructors_begin[], constructors_end[];

[[noreturn]] void start() {
#ifdef __ARM_FP
  absenc::machine::at(0xE000'ED88) = 0xF << 20;  // CPACR: the FPU is on
  asm volatile("dsb\nisb");
#endif
  const std::uint32_t* from = &data_load;
  for (std::uint32_t* to = &data_begin; to != &data_end;) *to++ = *from++;
  for (std::uint32_t* to = &bss_begin; to != &bss_end;) *to++ = 0;
  for (const Constructor* one = constructors_begin; one != constructors_end; ++one) (*one)();
  absenc::machine::paint_stack();
  main();
  absenc::machine::end(true);
}

// What nobody expects: a program that goes on after it would hide it.
[[noreturn]] void fault() {
  absenc::machine::say("fault\n");
  absenc::machine::end(false);
}

void tick();
void uart() { absenc::machine::handle_uart(); }

// A program without an exit has no destructors of static objects.
int __aeabi_atexit(void*, void (*)(void*), void*) { return 0; }
void* __dso_handle = nullptr;
[[noreturn]] void __cxa_pure_virtual() { fault(); }
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

// Of the devices nothing but the UART is asked for interrupts.
[[gnu::section(".vectors"), gnu::used]] const Vectors vectors{
    &stack_top, start, filled(std::array<void (*)(), 13>{}, fault), tick, filled(std::array<void (*)(), 32>{}, uart)};

}  // namespace

// Programs without interrupts have none of these.
namespace absenc::machine {
[[gnu::weak]] void on_tick() {}
[[gnu::weak]] void on_received(std::uint8_t) {}
[[gnu::weak]] void on_sent() {}
}  // namespace absenc::machine
