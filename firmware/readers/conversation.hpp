// SPDX-License-Identifier: Apache-2.0
// A conversation with an encoder that answers each request, and the marks between which the plugin count.cpp counts
// instructions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/link/can.hpp"
#include "absenc/link/step.hpp"

// The functions that mark begin and end must not be inlined, because the plugin finds them by their addresses.
#define ABSENC_MARKS(name)                                           \
  [[gnu::noinline]] inline void name##_begin() { asm volatile(""); } \
  [[gnu::noinline]] inline void name##_end() { asm volatile(""); }
extern "C" {
ABSENC_MARKS(count)  // the plugin prints each count between the marks `count`
ABSENC_MARKS(feed)   // for the marks `feed`, `next` and `result` the plugin prints only the greatest counts
ABSENC_MARKS(next)
ABSENC_MARKS(result)  // the marks `result` enclose the work from the event that ends a conversation to its result
}
#undef ABSENC_MARKS

namespace absenc::firmware {

/// How a reply arrives: in one event, as by DMA, or character by character.
enum class Delivery : std::uint8_t { whole, by_character };

template <class Item, class Reader>
bool converse(Reader& reader, std::span<const Item> reply, Delivery delivery) {
  using Kind = typename Event<Item>::Kind;
  Time now{1'000'000};
  std::span<const Item> remaining{};
  std::size_t clocked = 0;  // number of bits that the host clocks out of the encoder
  for (unsigned events = 0; events < 1000; ++events) {
    const Step<Item> step = reader.next(now);
    if (step.kind == Step<Item>::Kind::done || step.kind == Step<Item>::Kind::emit) return reader.reading() != nullptr;
    now += Time{1000};
    Event<Item> event{.kind = Kind::silence, .at = now};
    if (step.kind == Step<Item>::Kind::transfer) {
      event.kind = Kind::sent;
      remaining = reply;
      clocked = step.bits - step.out_bits;
    } else if (!remaining.empty()) {
      event.kind = Kind::received;
      event.items = delivery == Delivery::whole ? remaining : remaining.first(1);
      event.bits = std::min(clocked, 8 * event.items.size());
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

}  // namespace absenc::firmware
