// SPDX-License-Identifier: Apache-2.0
// State of one node of sim::Line. Internal to sim: shared by line.cpp and line_wires.cpp.
#pragma once

#include <algorithm>
#include <vector>

#include "absenc/link/silence.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::sim {

/// Returns the character on a line that two senders drive at once: a bit is 0 if it is 0 in either.
[[nodiscard]] inline std::uint8_t combine(std::uint8_t a, std::uint8_t b) { return a & b; }
/// Returns `a`, because CAN frames are arbitrated and never combined.
[[nodiscard]] inline CanFrame combine(const CanFrame& a, const CanFrame&) { return a; }

/// State of one node of a line.
template <class Item>
struct Line<Item>::State {
  NodeRole role{};                   ///< Whether the node is host or device.
  Machine<Item>* machine = nullptr;  ///< Machine of the node.
  OnEmit on_emit;                    ///< Function that is called at each `emit` step of the machine.
  LineSettings settings{};           ///< Settings of the node's end of the line.
  bool echo = false;                 ///< Whether the node receives what it sends.
  bool done = false;                 ///< Whether the machine of the node has ended.

  Step<Item> waiting{};    ///< last wait step of the machine
  Time timer_due = never;  ///< time of the `timer` event that the node's machine waits for; `never`: it waits for none
  Silence silence;         ///< Silence timer of the node.
  Time due = never;        ///< time of the next `timer` or `silence` event

  /// The sender whose character this node's receiver is synchronised to.
  Node framed_sender = 0;
  Time framed_from = never;  ///< Begin of the character that this node's receiver is synchronised to.
  Time framed_until{};       ///< End of the character that this node's receiver is synchronised to.

  /// Kind of the step in progress or about to begin: transfer or pulse; wait if there is none.
  typename Step<Item>::Kind active_step = Step<Item>::Kind::wait;
  /// counts the node's transfers, pulses and replaced machines, to recognise stale events
  std::uint64_t begin_generation = 0;
  /// whether the transfer or pulse has begun; of a transfer in frames: whether its present frame has
  bool begun = false;
  std::vector<Item> out;           ///< items of the transfer that the node sends
  std::size_t bits = 0;            ///< spi, clocked: number of bits of the transfer
  std::size_t frame = 0;           ///< number of items of each frame of `out`; 0: one frame
  std::size_t expect = 0;          ///< number of items that the node's machine expects to receive; 0: unknown, or none
  Time width{};                    ///< `width` of the step (link/step.hpp): duration, pause, or time of driving low
  std::uint8_t behind_out = 0xFF;  ///< spi, clocked: byte that the host samples after `out` has ended
  bool hold_low = false;           ///< clocked: the host holds the clock line low before the transfer
  std::size_t out_bits = 0;        ///< bidirectional clocked, host: number of clocks during which it drives `out`
  /// Bidirectional clocked, host: whether the clock line rests low behind the transfer.
  bool goes_on = false;
  /// Bidirectional clocked, host: end of the last transfer, if the present one belongs to its exchange; else `never`.
  Time goes_on_from = never;
  std::size_t clocks_before = 0;  ///< bidirectional clocked, host: number of clocks of the exchange before the transfer
  /// Bidirectional clocked, device: number of clocks of the exchange before the first bit of `out`.
  std::size_t driven_from = 0;
  Time accepted_at{};       ///< time at which the machine requested the transfer
  Time lead{};              ///< spi: time from chip select to the first clock
  ExtraWire pulse_wire{};   ///< wire of the pulse
  Time start{};             ///< start of the transfer, or of its present frame
  std::size_t index = 0;    ///< index in `out` of the item that is being sent or, between two items, is sent next
  std::size_t on_wire = 0;  ///< characters: number of items of the present or last frame of `out`; 0: none
  Time each{};              ///< duration of one byte on the line

  /// Returns whether a transfer of this node has begun and has items left to send.
  [[nodiscard]] bool frame_pending() const {
    return active_step == Step<Item>::Kind::transfer && begun && index < out.size();
  }

  /// Returns `item` combined with the characters of this node that are on the line between `from` and `to`.
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
