// SPDX-License-Identifier: Apache-2.0
// The base program: it has the start-up and measurement code of the readers, but reads nothing. figures.py
// subtracts its figures from those of the readers.
#include <cstring>

#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  volatile std::size_t size = 4;
  volatile char memory[8]{};
  auto* const bytes = const_cast<char*>(memory);
  std::memcpy(bytes, bytes + 4, size);
  std::memmove(bytes, bytes + 1, size);
  std::memset(bytes, 0, size);
  machine::paint_stack();
  count_begin();
  count_end();
  machine::print(machine::stack_used());
  machine::end(true);
}
