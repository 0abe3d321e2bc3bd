// SPDX-License-Identifier: Apache-2.0
// The wires of a simulated conversation as a value change dump (IEEE 1364, clause 18), which every waveform viewer
// reads.
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
/// - exchange: `cs`, `sck`, `mosi`, `miso`; nobody on miso is 1
/// - clocked: `clock`, idle high, and `data`, which changes at its rising edges. The host takes each bit at the falling
///   edge behind. With `idle_clocks` that is so many clocks more than there are bits.
class Waveform {
 public:
  /// Throws std::invalid_argument for CAN, whose bits nobody simulates.
  Waveform(LinkKind kind, const LineSettings& settings);

  /// From now on everything on `line`, of the same kind and settings. Takes its observers; must outlive it.
  void observe(Line<std::uint8_t>& line);

  /// One asynchronous character.
  void character(Role sender, Time start, Time end, std::uint8_t byte);
  void exchange(const Line<std::uint8_t>::Exchange& exchange);

  /// The file: each nanosecond is a unit of time; the comments before it list the items, `title` is one word.
  [[nodiscard]] std::string vcd(std::string_view title) const;

 private:
  struct Wire {
    std::string_view name;
    bool idle;
  };
  // Drives a wire away from its idle level, or (-1) lets it go: it is idle when nobody drives it.
  struct Change {
    Time at;
    std::size_t wire;
    int by;
  };
  struct Comment {
    Time at;
    std::string words;
  };

  void drive(std::size_t wire, Time from, Time to);
  void draw_clocked(const Line<std::uint8_t>::Exchange& exchange);
  void draw_exchange(const Line<std::uint8_t>::Exchange& exchange);
  [[nodiscard]] std::string changes() const;

  LinkKind kind_;
  LineSettings settings_;
  std::vector<Wire> wires_;
  std::vector<Change> changes_;
  std::vector<Comment> comments_;
  Time end_{};
};

}  // namespace absenc::sim
