// SPDX-License-Identifier: Apache-2.0
// QEMU's RISC-V machine, for programs without interrupts, clock and UART.
#include "firmware/machine/machine.hpp"

extern "C" {
// QEMU begins execution here, and has set up neither a stack nor a trap vector.
[[gnu::naked, gnu::used, gnu::section(".vectors")]] void reset() {
  asm(".option arch, +zicsr\n"
      "la sp, stack_top\n"
      "la t0, 1f\n"
      "csrw mtvec, t0\n"
      "j start\n"
      ".balign 4\n"
      "1: j fault");
}
}

namespace absenc::machine {

// The semihosting call: a breakpoint between two uncompressed no-ops (RISC-V Semihosting, 2).
[[gnu::noinline]] std::uint32_t call_emulator(std::uint32_t number, const void* parameter) {
  register std::uint32_t a0 asm("a0") = number;
  register const void* a1 asm("a1") = parameter;
  asm volatile(
      ".option push\n"
      ".option norvc\n"
      ".balign 16\n"  // the alignment keeps the three instructions in one page of memory
      "slli zero, zero, 0x1f\n"
      "ebreak\n"
      "srai zero, zero, 7\n"
      ".option pop"
      : "+r"(a0)
      : "r"(a1)
      : "memory");
  return a0;
}

}  // namespace absenc::machine
