// SPDX-License-Identifier: Apache-2.0
// The wires of a simulated conversation: when each changes its level.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <queue>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/bytes.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::sim {

/// Draws what it is told, or what it sees on a line, with levels as of logic: an idle line and a mark are 1. It keeps
/// no more than what is not settled: characters of two pairs overlap, and files want their times in order.
///
/// - half duplex: `line`; full duplex: `host` and `device`, by who drives the pair
/// - beside these, when there were pulses: `trigger`, `clear`, which a pulse pulls to 0
/// - spi: `cs`, `sck`, `mosi`, `miso`; nobody on miso is 1
/// - clocked: `clock`, idle high, and `data`, which changes at its rising edges. The host takes each bit at the falling
///   edge behind. With `idle_clocks` that is so many clocks more than there are bits. Behind the last edge the device
///   may hold `data` low: the timeout of BiSS, the monoflop of SSI.
/// - CAN: `can`, recessive is 1; every frame is acknowledged
class Waveform {
 public:
  struct Wire {
    std::string_view name;
    bool idle;  // the level before the first change
  };
  /// Gets everything in the order of time, as soon as that is known.
  struct Sink {
    /// Inverts the level of this wire, of `wires()`.
    virtual void change(Time at, std::size_t wire) = 0;
    /// What an item was, in words.
    virtual void comment(Time at, std::string_view words) = 0;

   protected:
    ~Sink() = default;
  };

  /// `sink` must outlive it.
  Waveform(LinkKind kind, const LineSettings& settings, Sink& sink);

  /// From now on everything on `line`, of the same kind and settings. Takes its observers; must outlive it.
  void observe(Line<std::uint8_t>& line);
  void observe(Line<CanFrame>& line);

  /// One asynchronous character.
  void character(Role sender, Time start, Time end, std::uint8_t byte);
  void transfer(const Line<std::uint8_t>::Transfer& transfer);
  void frame(Time start, const CanFrame& frame);
  void pulse(ExtraWire wire, Time start, Time end);

  /// The sink gets what is before `time`: nothing that is told later may begin before it.
  void settle(Time time);
  /// The sink gets all there is.
  void finish() { settle(never); }

  /// Those of pulses are added by the first pulse.
  [[nodiscard]] const std::vector<Wire>& wires() const { return wires_; }
  /// Of the last item.
  [[nodiscard]] Time end() const { return end_; }

 private:
  // Drives a wire away from its idle level, or (-1) lets it go: it is idle when nobody drives it.
  struct Change {
    Time at;
    std::size_t wire;
    int by;
    bool operator>(const Change& other) const { return at > other.at; }
  };
  struct Comment {
    Time at;
    std::string words;
  };

  void drive(std::size_t wire, Time from, Time to);
  void comment(Time at, std::string words);
  std::size_t pulse_wire(std::string_view name);
  void draw_clocked(const Line<std::uint8_t>::Transfer& transfer);
  void draw_spi(const Line<std::uint8_t>::Transfer& transfer);

  LinkKind kind_;
  LineSettings settings_;
  Sink* sink_;
  std::vector<Wire> wires_;
  std::vector<int> drivers_;  // of each wire
  // What the sink has not got yet:
  std::priority_queue<Change, std::vector<Change>, std::greater<>> changes_;
  std::vector<Comment> comments_;  // in the order of time
  Time end_{};
};

}  // namespace absenc::sim
