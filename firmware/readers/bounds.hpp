// SPDX-License-Identifier: Apache-2.0
// Finds the greatest costs of the calls of a reader. For this it gives the reader every reply in the vectors of the
// unit ABSENC_UNIT, undamaged and damaged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/protocol/all.hpp"
#include "absenc/protocol/vector_check.hpp"
#include "firmware/machine/machine.hpp"
#include "firmware/readers/conversation.hpp"
#include "firmware/readers/counted.hpp"
#include "firmware/vectors.hpp"

namespace absenc::firmware {

/// A copy of the bytes or frames of a reply. The reply must fit into its buffer.
template <class Item>
class LineContent {
 public:
  void set(std::span<const Item> items) {
    items_.clear();
    add(items);
  }
  void add(std::span<const Item> items) {
    for (const Item& item : items) {
      if (!items_.push_back(item)) machine::end(false);
    }
  }
  [[nodiscard]] std::span<const Item> view() const { return items_.view(); }
  Item& operator[](std::size_t index) { return items_[index]; }

 private:
  Buffer<Item, 512> items_;
};

/// Calls `visit` once for each bit of `byte`, with that bit inverted.
template <class Visit>
void damage(std::uint8_t& byte, const Visit& visit) {
  const std::uint8_t sound = byte;
  for (unsigned bit = 0; bit < 8; ++bit) {
    byte = static_cast<std::uint8_t>(sound ^ 1u << bit);
    visit();
  }
  byte = sound;
}

/// Calls `visit` with a copy of `frame` for each bit, with that bit inverted, and for each other number of data bytes.
template <class Visit>
void damage(CanFrame& frame, const Visit& visit) {
  const CanFrame sound = frame;
  for (std::uint8_t& byte : frame.data) damage(byte, visit);
  for (unsigned bit = 0; bit < 29; ++bit) {
    frame.id = sound.id ^ 1u << bit;
    visit();
  }
  frame = sound;
  for (frame.size = 0; frame.size <= frame.data.size(); ++frame.size) visit();
  frame = sound;
  frame.remote = !sound.remote;
  visit();
  frame = sound;
  frame.extended = !sound.extended;
  visit();
  frame = sound;
}

/// Returns the next number of a sequence that is the same in each run, below `limit`.
inline std::uint32_t random_below(std::uint32_t limit) {
  static std::uint32_t state = 1;
  state = state * 1'664'525 + 1'013'904'223;
  return (state >> 8) % limit;
}

inline std::uint8_t& byte_of(std::uint8_t& item, std::uint32_t) { return item; }
inline std::uint8_t& byte_of(CanFrame& frame, std::uint32_t index) { return frame.data[index % frame.data.size()]; }

/// Calls `visit` with copies of `reply` in `line` in which two to nine random bits are inverted.
template <class Item, class Visit>
void vary_at_random(LineContent<Item>& line, std::span<const Item> reply, const Visit& visit) {
  constexpr unsigned copies = 40;
  const auto size = static_cast<std::uint32_t>(reply.size());
  for (unsigned copy = 0; copy < copies; ++copy) {
    line.set(reply);
    for (std::uint32_t left = 2 + random_below(8); left > 0; --left) {
      byte_of(line[random_below(size)], random_below(8)) ^= static_cast<std::uint8_t>(1u << random_below(8));
    }
    visit();
  }
}

/// Calls `visit` with `reply`, with damaged and truncated copies of it, with further bytes or frames before and after
/// it, and with two replies in a row.
template <class Item, class Visit>
void vary(std::span<const Item> reply, const Visit& visit) {
  static LineContent<Item> line;
  const auto visit_line = [&visit] { visit(line.view()); };
  line.set(reply);
  visit_line();
  for (std::size_t size = 0; size < reply.size(); ++size) visit(line.view().first(size));
  for (std::size_t i = 0; i < reply.size(); ++i) damage(line[i], visit_line);
  if (reply.empty()) return;
  vary_at_random<Item>(line, reply, visit_line);
  for (const Item& extra : {Item{}, reply.front(), reply.back()}) {
    line.set({&extra, 1});
    line.add(reply);
    visit_line();
    line.set(reply);
    line.add({&extra, 1});
    visit_line();
  }
  line.set(reply);
  line.add(reply);
  visit_line();
}

inline void set_frame(LineContent<CanFrame>& line, const Unit&, Bytes text) {
  const CanFrame frame = can_frame_of_text(text);
  line.set({&frame, 1});
}
inline void set_frame(LineContent<std::uint8_t>& line, const Unit& unit, Bytes bytes) {
  line.set(carries_bits(unit.link) ? bits_of_text(bytes).bytes() : bytes);
}

/// Calls `visit` with every reply in the vectors of the unit ABSENC_UNIT, and each of its variations.
template <class Item, class Visit>
void vary_vectors(const Visit& visit) {
  static LineContent<Item> reply;
  const Unit* const unit = find_unit(ABSENC_UNIT);
  if (unit == nullptr) machine::end(false);
  const auto vary_reply = [&](Bytes bytes) {
    if (bytes.empty()) return;
    set_frame(reply, *unit, bytes);
    vary<Item>(reply.view(), visit);
  };
  for (const Vector& vector : unit->vectors) vary_reply(vector.reply);
  for (const ReferenceVector& vector : reference_vectors()) {
    if (vector.unit == unit->id) vary_reply(vector.reply);
  }
}

/// Gives a reader `reply` and every vector, with all variations, and prints the number of conversations. Then ends the
/// emulator, with failure if the reader did not accept `reply`.
template <class Item, class Reader, class... Parameters>
[[noreturn]] void find_bounds(std::span<const Item> reply, bool by_character, const Parameters&... parameters) {
  static Counted<Reader> reader;
  std::uint32_t conversations = 0;
  const auto read = [&](std::span<const Item> items, Delivery delivery) {
    ++conversations;
    reader.make(parameters...);
    return converse<Item>(reader, items, delivery);
  };
  bool good = read(reply, Delivery::whole);
  if (by_character) good = read(reply, Delivery::by_character) && good;
  const auto visit = [&](std::span<const Item> items) {
    static_cast<void>(read(items, Delivery::whole));
    if (by_character) static_cast<void>(read(items, Delivery::by_character));
  };
  vary<Item>(reply, visit);
  vary_vectors<Item>(visit);
  machine::print(conversations);
  machine::end(good);
}

}  // namespace absenc::firmware
