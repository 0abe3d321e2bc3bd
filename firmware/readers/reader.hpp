// SPDX-License-Identifier: Apache-2.0
// Firmware that reads a position and nothing else: what of the library it links is measured, and what it does between
// two marks is counted (firmware/count.cpp). No wire is there: a good reply follows each request at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>

#include "absenc/link/can.hpp"
#include "absenc/link/step.hpp"
#include "firmware/machine/machine.hpp"

// Instructions between them are counted; called, never inlined.
extern "C" {
[[gnu::noinline]] inline void count_begin() { asm volatile(""); }
[[gnu::noinline]] inline void count_end() { asm volatile(""); }
}

namespace absenc::firmware {

/// How a reply comes: in one event, as by DMA, which is counted; or character by character, where the second is counted
/// with what is asked after it.
enum class Comes : std::uint8_t { whole, by_character };

template <class Item, class Reader>
bool converse(Reader& reader, std::span<const Item> reply, Comes comes) {
  using Kind = typename Event<Item>::Kind;
  Time now{1'000'000};
  std::span<const Item> coming{};
  for (unsigned events = 0; events < 1000; ++events) {
    const Step<Item> step = reader.next(now);
    if (step.kind == Step<Item>::Kind::done || step.kind == Step<Item>::Kind::emit) return reader.reading() != nullptr;
    now += Time{1000};
    Event<Item> event{.kind = Kind::silence, .at = now};
    if (step.kind == Step<Item>::Kind::transfer) {
      event.kind = Kind::sent;
      coming = reply;
    } else if (!coming.empty()) {
      event.kind = Kind::received;
      event.items = comes == Comes::whole ? coming : coming.first(1);
      coming = coming.subspan(event.items.size());
    } else if (step.at > now && step.at != never) {
      event.kind = Kind::timer;
      now = event.at = step.at;
    }
    const bool is_reply = comes == Comes::whole && event.kind == Kind::received;
    const bool is_second = comes == Comes::by_character && coming.size() + 2 == reply.size();
    if (is_reply || is_second) count_begin();
    reader.feed(event);
    if (is_second) static_cast<void>(reader.next(now));
    if (is_reply || is_second) count_end();
  }
  return false;
}

/// Counts, and ends the emulator; well when a position was read. `by_character`: where interrupts bring characters.
template <class Item, class Reader, class... Parameters>
[[noreturn]] void run(std::span<const Item> reply, bool by_character, const Parameters&... parameters) {
  alignas(Reader) static std::byte memory[sizeof(Reader)];
  machine::paint_stack();
  count_begin();
  bool good = converse<Item>(*new (memory) Reader(parameters...), reply, Comes::whole);
  count_end();
  machine::say(machine::stack_used());
  if (by_character) good = converse<Item>(*new (memory) Reader(parameters...), reply, Comes::by_character) && good;
  machine::end(good);
}

}  // namespace absenc::firmware
