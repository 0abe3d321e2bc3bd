// SPDX-License-Identifier: Apache-2.0
// Decodes bursts of clocked bits from level changes: SSI, BiSS, SPI.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// Settings of a clocked line; the idle level of the clock does not matter.
struct ClockedFormat {
  // true: a bit is the level just before a rising edge of the clock; false: before a falling one
  bool rising = false;
  bool has_select = false;   // true: chip select begins and ends words; the clock may pause within a word
  bool select_high = false;  // true: chip select is active high
  Tick pause = 0;            // without chip select: a clock that rests longer than this ends a word, in ticks
  // without chip select: time from the last clock change to the sample of the word's last bit, in ticks; 0: not sampled
  Tick settle = 0;
  // without chip select: a clock that rests longer than this, in ticks, ends a word if the data line changes during the
  // rest; 0: unused
  Tick change_pause = 0;
  // without chip select: number of further samples behind that of the word's last bit, a clock period apart, because
  // the line delays the bits
  std::uint8_t tail = 0;
  // without chip select: a rest of the clock at its low level never ends a word
  bool low_goes_on = false;
};

/// Lengths of the rests of a clock between words, measured in the first changes of the clock.
struct ClockRests {
  Tick half_period = 0;
  Tick longest = 0;
  // possible limits, in ticks, above which a rest ends a word; the first is three clock periods
  std::vector<Tick> pauses;
};

/// Measures the rests of a clock; returns nothing if the clock has too few changes.
std::optional<ClockRests> find_rests(const Changes& clock);

/// A part of the capture with the changes of its wires. All but `clock` may be null.
struct ClockedPart {
  const Changes* clock;
  const Changes* in = nullptr;
  const Changes* out = nullptr;
  const Changes* select = nullptr;
  const Changes* direction = nullptr;
  Tick first = 0;
  Tick end = 0;
};

/// A decoder of clocked bursts, which decodes a capture part by part. An incomplete burst is marked as cut.
class ClockedDecoder {
 public:
  static constexpr std::size_t most_bits = 65536;  // longest burst, in bits; a longer burst is cut into pieces

  explicit ClockedDecoder(const ClockedFormat& format) : format_(format) {}

  /// Clears the state. Call it if the next part of the capture does not follow the previous one.
  void restart() { *this = ClockedDecoder(format_); }
  void decode(const ClockedPart& part, std::vector<Burst>& bursts);
  /// Works like `decode`, but takes over bursts from `guessed`: `other` decoded them from this part after a restart.
  void join(const ClockedPart& part, ClockedDecoder& other, std::vector<Burst>& guessed, std::vector<Burst>& bursts);
  /// Ends the capture; a burst in progress is appended as cut.
  void finish(std::vector<Burst>& bursts);
  /// Returns a time before which no further burst begins; `end` is the end of the last decoded part of the capture.
  [[nodiscard]] Tick settled(Tick end) const { return open_ ? burst_.begin : end; }

 private:
  // The level changes of one wire in the part of the capture that is decoded.
  struct Wire {
    bool level = false;
    std::span<const Tick> left{};  // changes of the wire that are not handled yet, in ticks
    // additional change of the wire at the border of two parts of the capture, if the levels there differ
    std::optional<Tick> border{};

    void begin(const Changes* changes, Tick first, bool known);
    [[nodiscard]] Tick next() const;
    void step();
    bool before(Tick at);  // handles the changes before the tick `at` and returns the level behind them
  };
  struct Targets {
    std::span<const Burst> bursts;
    const Burst* open;  // burst that the decoder of `bursts` has begun and not completed; null: none
    std::size_t next = 0;
    bool met = false;
  };

  void begin_part(const ClockedPart& part);
  bool run(const ClockedPart& part, Targets* targets, std::vector<Burst>& bursts);
  bool clock_changes(Tick at, Targets* targets, std::vector<Burst>& bursts);
  bool select_changes(Tick at, Targets* targets, std::vector<Burst>& bursts);
  bool open(Tick at, bool cut, Targets* targets);
  void close(Tick at, bool cut, std::vector<Burst>& bursts);
  void take(Tick at, std::vector<Burst>& bursts);
  void detect_data_change(Tick until);
  [[nodiscard]] bool is_over(Tick rest) const;
  void sample_last_bits(Tick until);

  ClockedFormat format_;
  bool begun_ = false;
  bool has_in_ = false;
  bool has_out_ = false;
  bool has_direction_ = false;
  Wire clock_;
  Wire in_;
  Wire out_;
  Wire select_;
  Wire direction_;
  Tick half_ = 0;  // time between the last two changes of the clock, in ticks
  Tick last_ = 0;  // time of the last clock change, or the beginning of the capture, in ticks
  bool seen_pause_ = false;
  bool open_ = false;
  bool lone_ = false;     // true, without chip select: the clock has changed at most once in the present burst
  bool fell_ = false;     // true: since the last word the clock has fallen once, and then rested at low level
  bool changed_ = false;  // true: the data line has changed during the present rest of the clock
  Burst burst_;
};

}  // namespace absenc::capture
