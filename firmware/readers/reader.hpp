// SPDX-License-Identifier: Apache-2.0
// Firmware that only reads a position, for measurements. Each source but base.cpp is built twice: as `reader-...`,
// which reads one position, and as `bounds-...` with ABSENC_UNIT, which gives the same reader every reply of the unit's
// vectors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>

#include "firmware/machine/machine.hpp"
#include "firmware/readers/conversation.hpp"
#ifdef ABSENC_UNIT
#include "firmware/readers/bounds.hpp"
#endif

namespace absenc::firmware {

/// Measures a reader, then ends the emulator. `by_character`: measures the reader also with a reply that arrives
/// character by character.
template <class Item, class Reader, class... Parameters>
[[noreturn]] void run(std::span<const Item> reply, bool by_character, const Parameters&... parameters) {
#ifdef ABSENC_UNIT
  find_bounds<Item, Reader>(reply, by_character, parameters...);
#else
  alignas(Reader) static std::byte memory[sizeof(Reader)];
  machine::paint_stack();
  count_begin();
  bool good = converse<Item>(*new (memory) Reader(parameters...), reply, Delivery::whole);
  count_end();
  machine::print(machine::stack_used());
  if (by_character) good = converse<Item>(*new (memory) Reader(parameters...), reply, Delivery::by_character) && good;
  machine::end(good);
#endif
}

}  // namespace absenc::firmware
