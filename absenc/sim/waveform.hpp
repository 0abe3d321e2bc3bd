// SPDX-License-Identifier: Apache-2.0
// Draws the wires of a simulated conversation: the times at which each wire changes its level.
#pragma once

#include <array>
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

/// A drawing of the wires of a line, as logic levels.
///
/// - half duplex: `line`; full duplex: `host` and `device`, named by the sender; idle is 1
/// - spi: `cs`, `sck`, `mosi`, `miso`
/// - clocked: `clock` and `data`, both idle high; `idle_clocks` adds clocks before the first bit
/// - bidirectional clocked: `clock`, `data`, and `direction`, which is 1 while the host drives `data`
/// - CAN: `can`, recessive is 1
/// - for pulses: `trigger` and `clear`, pulled to 0
class Waveform {
 public:
  /// A wire of a waveform, for example `clock`.
  struct Wire {
    std::string_view name;  ///< name of the wire
    bool idle;              ///< level of the wire before its first change
  };
  /// Receiver of level changes and of comments, each in the order of time.
  struct Sink {
    /// Receives a level change of the wire that has the index `wire` in `wires()`.
    virtual void change(Time at, std::size_t wire) = 0;
    /// Receives a description of one drawn item in words.
    virtual void comment(Time at, std::string_view words) = 0;

   protected:
    ~Sink() = default;
  };

  /// Makes a waveform without items. `sink` must outlive it.
  Waveform(LinkKind kind, const LineSettings& settings, Sink& sink);

  /// Draws all items on `line` from now on and replaces its observers. The waveform must outlive the line.
  void observe(Line<std::uint8_t>& line);
  /// Draws all frames on `line` from now on and replaces its observer. The waveform must outlive the line.
  void observe(Line<CanFrame>& line);

  /// Draws a byte. If an asynchronous character carries two bytes, both are drawn when the second one is added.
  void byte(NodeRole sender, Time start, Time end, std::uint8_t byte);
  /// Draws one asynchronous character with the data bits `value`.
  void character(NodeRole sender, Time start, Time end, std::uint16_t value);
  /// Draws a transfer of an SPI or clocked link.
  void transfer(const Line<std::uint8_t>::Transfer& transfer);
  /// Draws a CAN frame.
  void frame(Time start, const CanFrame& frame);
  /// Draws a pulse on an extra wire.
  void pulse(ExtraWire wire, Time start, Time end);

  /// Passes all changes and comments before `time` to the sink. No later item may begin before `time`.
  void settle(Time time);
  /// Passes all remaining changes and comments to the sink.
  void finish();

  /// Returns the wires; extra wires are added when their first pulse is drawn.
  [[nodiscard]] const std::vector<Wire>& wires() const { return wires_; }
  /// Returns the time behind which nothing is drawn: the latest end of all drawn items and levels.
  [[nodiscard]] Time end() const { return end_; }

 private:
  // The time from which (`by` 1) or up to which (`by` -1) a sender drives a wire away from its idle level.
  struct LevelChange {
    Time at;
    std::size_t wire;
    int by;
    bool operator>(const LevelChange& other) const { return at > other.at; }
  };
  struct Comment {
    Time at;
    std::string words;
  };

  // The first byte of a character of two bytes, stored until its second byte is on the line.
  struct FirstByte {
    NodeRole sender{};
    Time start = never;  // begin of the character; `never`: no first byte is stored
    Time end{};
    std::uint8_t byte = 0;
  };

  void draw_lone(FirstByte& first);
  [[nodiscard]] std::size_t data_wire(NodeRole sender) const;
  void drive(std::size_t wire, Time from, Time to);
  void comment(Time at, std::string words);
  std::size_t pulse_wire(std::string_view name);
  void draw_clocked(const Line<std::uint8_t>::Transfer& transfer);
  void draw_both_ways(const Line<std::uint8_t>::Transfer& transfer);
  void draw_spi(const Line<std::uint8_t>::Transfer& transfer);

  LinkKind kind_;
  LineSettings settings_;
  Sink* sink_;
  std::vector<Wire> wires_;
  // for each wire, the number of calls of `drive` whose time includes the present: 0 means the idle level
  std::vector<int> drivers_;
  // Level changes that the sink has not received yet, the earliest on top.
  std::priority_queue<LevelChange, std::vector<LevelChange>, std::greater<>> changes_;
  std::vector<Comment> comments_;           // comments that the sink has not received, in the order of time
  std::array<FirstByte, 2> first_bytes_{};  // first bytes of characters of two bytes, indexed by the wire
  Time end_{};
};

}  // namespace absenc::sim
