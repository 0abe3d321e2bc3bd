// SPDX-License-Identifier: Apache-2.0
// Firmware that only reads a position, for measurements. A good reply follows each request.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>

#include "absenc/link/can.hpp"
#include "absenc/link/step.hpp"
#include "firmware/machine/machine.hpp"

// Marks of code whose instructions are counted; they must not be inlined.
extern "C" {
[[gnu::noinline]] inline void count_begin() { asm volatile(""); }
[[gnu::noinline]] inline void count_end() { asm volatile(""); }
}

namespace absenc::firmware {

/// How a reply arrives: in one event, as by DMA, or character by character.
enum class Delivery : std::uint8_t { whole, by_character };

template <class Item, class Reader>
bool converse(Reader& reader, std::span<const Item> reply, Delivery delivery) {
  using Kind = typename Event<Item>::Kind;
  Time now{1'000'000};
  std::span<const Item> remaining{};
  for (unsigned events = 0; events < 1000; ++events) {
    const Step<Item> step = reader.next(now);
    if (step.kind == Step<Item>::Kind::done || step.kind == Step<Item>::Kind::emit) return reader.reading() != nullptr;
    now += Time{1000};
    Event<Item> event{.kind = Kind::silence, .at = now};
    if (step.kind == Step<Item>::Kind::transfer) {
      event.kind = Kind::sent;
      remaining = reply;
    } else if (!remaining.empty()) {
      event.kind = Kind::received;
      event.items = delivery == Delivery::whole ? remaining : remaining.first(1);
      remaining = remaining.subspan(event.items.size());
    } else if (step.at > now && step.at != never) {
      event.kind = Kind::timer;
      now = event.at = step.at;
    }
    const bool is_reply = delivery == Delivery::whole && event.kind == Kind::received;
    const bool is_second = delivery == Delivery::by_character && remaining.size() + 2 == reply.size();
    if (is_reply || is_second) count_begin();
    reader.feed(event);
    if (is_second) static_cast<void>(reader.next(now));
    if (is_reply || is_second) count_end();
  }
  return false;
}

/// Measures a reader, then ends the emulator. `by_character`: also measures single characters.
template <class Item, class Reader, class... Parameters>
[[noreturn]] void run(std::span<const Item> reply, bool by_character, const Parameters&... parameters) {
  alignas(Reader) static std::byte memory[sizeof(Reader)];
  machine::paint_stack();
  count_begin();
  bool good = converse<Item>(*new (memory) Reader(parameters...), reply, Delivery::whole);
  count_end();
  machine::print(machine::stack_used());
  if (by_character) good = converse<Item>(*new (memory) Reader(parameters...), reply, Delivery::by_character) && good;
  machine::end(good);
}

}  // namespace absenc::firmware
