// SPDX-License-Identifier: Apache-2.0
// From reset to main, as soon as there is a stack. A part's own start-up takes its place.
#include "firmware/machine/machine.hpp"

int main();

extern "C" {
extern std::uint32_t data_load, data_begin, data_end, bss_begin, bss_end;
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

// A program without an exit has no destructors of static objects.
#ifdef __riscv
int __cxa_atexit(void (*)(void*), void*, void*) { return 0; }
#else
int __aeabi_atexit(void*, void (*)(void*), void*) { return 0; }
#endif
void* __dso_handle = nullptr;
[[noreturn]] void __cxa_pure_virtual() { fault(); }
}

// Programs without interrupts have none of these.
namespace absenc::machine {
[[gnu::weak]] void on_tick() {}
[[gnu::weak]] void on_received(std::uint8_t) {}
[[gnu::weak]] void on_sent() {}
}  // namespace absenc::machine
