// SPDX-License-Identifier: Apache-2.0
// Start-up from reset to main. On a real part, its own start-up code replaces this file.
#include "firmware/machine/machine.hpp"

int main();

extern "C" {
extern std::uint32_t data_load, data_begin, data_end, bss_begin, bss_end;
using Constructor = void (*)();
extern const Constructor constructors_begin[], constructors_end[];

[[noreturn]] void start() {
#ifdef __ARM_FP
  absenc::machine::register_at(0xE000'ED88) = 0xF << 20;  // the register CPACR, which enables the FPU
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

// An unexpected fault ends the program with a failure, because continuing would hide it.
[[noreturn]] void fault() {
  absenc::machine::print("fault\n");
  absenc::machine::end(false);
}

// Registers no destructors: static objects are never destroyed, because the program never exits.
#ifdef __riscv
int __cxa_atexit(void (*)(void*), void*, void*) { return 0; }
#else
int __aeabi_atexit(void*, void (*)(void*), void*) { return 0; }
#endif
void* __dso_handle = nullptr;
[[noreturn]] void __cxa_pure_virtual() { fault(); }
}

// Default handlers of interrupts, for programs that use no interrupts.
namespace absenc::machine {
[[gnu::weak]] void on_tick() {}
[[gnu::weak]] void on_received(std::uint8_t) {}
[[gnu::weak]] void on_sent() {}
}  // namespace absenc::machine
