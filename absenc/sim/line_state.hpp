// SPDX-License-Identifier: Apache-2.0
// What sim::Line knows about one node. Internal to sim: shared by line.cpp and line_wires.cpp.
#pragma once

#include <algorithm>
#include <vector>

#include "absenc/link/silence.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::sim {

[[nodiscard]] inline std::uint8_t combine(std::uint8_t a, std::uint8_t b) { return a & b; }
[[nodiscard]] inline CanFrame combine(const CanFrame& a, const CanFrame&) { return a; }

template <class Item>
struct Line<Item>::State {
  Role role{};
  Machine<Item>* machine = nullptr;
  OnEmit on_emit;
  LineSettings settings{};
  bool echo = false;
  bool done = false;

  Step<Item> waiting{};    // the last wait step
  Time timer_due = never;  // its `at`, until it is told
  Silence silence;
  Time due = never;  // the next timer or silence

  // Which sender's character this node's receiver is synchronised to; what begins before its end is not seen apart.
  Node framed_sender = 0;
  Time framed_from = never;
  Time framed_until{};

  typename Step<Item>::Kind doing = Step<Item>::Kind::wait;  // transfer or pulse in progress or pending
  std::uint64_t begin_generation = 0;                        // counts transfers and pulses
  bool begun = false;                                        // false while `at` lies ahead
  std::vector<Item> out;
  std::size_t bits = 0;
  std::size_t expect = 0;
  Time width{};
  std::uint8_t behind_out = 0xFF;  // on a clocked link: what the host samples behind `out`
  bool hold_low = false;  // clocked: the level of the clock before the transfer
  Time taken_up{};        // when it was asked for
  Time lead{};            // spi: from chip select to the first clock
  ExtraWire pulse_wire{};
  Time start{};             // of the transfer; CAN: of the frame
  std::size_t index = 0;    // the item on the wire
  std::size_t on_wire = 0;  // items of `out` that were, are or will be on the wire
  Time each{};              // time of one character

  [[nodiscard]] bool frame_pending() const {
    return doing == Step<Item>::Kind::transfer && begun && index < out.size();
  }

  // All characters of this node that overlap [from, to), combined with `item`.
  [[nodiscard]] Item overlaid(Item item, Time from, Time to) const {
    if (each.count() == 0) return item;
    const auto first = static_cast<std::size_t>(std::max<std::int64_t>(0, (from - start) / each));
    for (std::size_t i = first; i < on_wire; ++i) {
      const Time item_start = start + each * static_cast<std::int64_t>(i);
      if (item_start >= to) break;
      if (item_start + each > from) item = combine(item, out[i]);
    }
    return item;
  }
};

}  // namespace absenc::sim
