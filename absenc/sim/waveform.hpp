// SPDX-License-Identifier: Apache-2.0
// The wires of a simulated conversation: when each changes its level.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/bytes.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::sim {

/// Draws what it is told, or what it sees on a line, with levels as of logic: an idle line and a mark are 1.
///
/// - half duplex: `line`; full duplex: `host` and `device`, by who drives the pair
/// - beside these, when there were pulses: `trigger`, `clear`, which a pulse pulls to 0
/// - exchange: `cs`, `sck`, `mosi`, `miso`; nobody on miso is 1
/// - clocked: `clock`, idle high, and `data`, which changes at its rising edges. The host takes each bit at the falling
///   edge behind. With `idle_clocks` that is so many clocks more than there are bits.
/// - CAN: `can`, recessive is 1; every frame is acknowledged
class Waveform {
 public:
  struct Wire {
    std::string_view name;
    bool idle;
    bool before = idle;           // the level at first
    std::vector<Time> changes{};  // in rising order; each inverts the level
  };
  /// What an item was, in words.
  struct Comment {
    Time at;
    std::string words;
  };

  Waveform(LinkKind kind, const LineSettings& settings);

  /// From now on everything on `line`, of the same kind and settings. Takes its observers; must outlive it.
  void observe(Line<std::uint8_t>& line);
  void observe(Line<CanFrame>& line);

  /// One asynchronous character.
  void character(Role sender, Time start, Time end, std::uint8_t byte);
  void exchange(const Line<std::uint8_t>::Exchange& exchange);
  void frame(Time start, const CanFrame& frame);
  void pulse(absenc::Line line, Time start, Time end);

  [[nodiscard]] std::vector<Wire> wires() const;
  /// In the order of time.
  [[nodiscard]] std::vector<Comment> comments() const;
  /// Of the last item.
  [[nodiscard]] Time end() const { return end_; }

 private:
  // Drives a wire away from its idle level, or (-1) lets it go: it is idle when nobody drives it.
  struct Change {
    Time at;
    std::size_t wire;
    int by;
  };

  void drive(std::size_t wire, Time from, Time to);
  std::size_t pulse_wire(std::string_view name);
  void draw_clocked(const Line<std::uint8_t>::Exchange& exchange);
  void draw_exchange(const Line<std::uint8_t>::Exchange& exchange);

  LinkKind kind_;
  LineSettings settings_;
  std::vector<Wire> wires_;
  std::vector<Change> changes_;
  std::vector<Comment> comments_;
  Time end_{};
};

}  // namespace absenc::sim
