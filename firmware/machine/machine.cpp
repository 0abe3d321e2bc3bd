// SPDX-License-Identifier: Apache-2.0
#include "firmware/machine/machine.hpp"

#include <algorithm>
#include <array>

extern "C" std::uint32_t bss_end, stack_top;

namespace absenc::machine {

// ---- Semihosting

namespace {
constexpr std::uint32_t write_text = 0x04, get_arguments = 0x15, exit_with_status = 0x20;
}

void print(std::string_view text) {
  std::array<char, 64> piece;
  while (!text.empty()) {
    const std::size_t size = std::min(text.size(), piece.size() - 1);
    std::copy_n(text.begin(), size, piece.begin());
    piece[size] = 0;
    call_emulator(write_text, piece.data());
    text.remove_prefix(size);
  }
}

void print(std::uint64_t number) {
  std::array<char, 20> digits;
  std::size_t at = digits.size();
  do {
    digits[--at] = static_cast<char>('0' + number % 10);
    number /= 10;
  } while (number != 0);
  print({digits.data() + at, digits.size() - at});
}

void end(bool good) {
  const std::array<std::uint32_t, 2> reason{0x20026, good ? 0u : 1u};  // the reason "application exit", with a status
  call_emulator(exit_with_status, reason.data());
  for (;;) {
  }
}

std::uint32_t argument(unsigned index, std::uint32_t otherwise) {
  std::array<char, 128> text{};
  struct {
    char* text;
    std::uint32_t size;
  } block{text.data(), text.size()};
  if (call_emulator(get_arguments, &block) != 0) return otherwise;
  const char* one = text.data();
  // skips the program's name, which is the first word, and the arguments before the one with the number `index`
  for (unsigned i = 0; i <= index; ++i) {
    while (*one != ' ' && *one != 0) ++one;
    while (*one == ' ') ++one;
  }
  if (*one < '0' || *one > '9') return otherwise;
  std::uint32_t number = 0;
  for (; *one >= '0' && *one <= '9'; ++one) number = 10 * number + static_cast<std::uint32_t>(*one - '0');
  return number;
}

// ---- Stack: the memory below the stack pointer is filled with a pattern

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
