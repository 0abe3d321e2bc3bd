// SPDX-License-Identifier: Apache-2.0
// Bursts of clocked bits from level changes: SSI, BiSS, SPI with or without chip select.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// The level a clock idles at makes no difference: a word is a run of its changes.
struct ClockedFormat {
  bool rising = false;       // the change of the clock that takes a bit; the bit is the level just before it
  bool has_select = false;   // words end with chip select; its clocks may pause
  bool select_high = false;  // chip select is active high
  Tick pause = 0;            // without chip select: a clock that rests for longer ends a word
  Tick settle = 0;           // then: so long behind the last change its bit stands on the line; 0: not looked at
  Tick change_pause = 0;     // then: a clock that rests for longer ends a word, too, if the data line changes in the
                             // rest, behind `settle`: a timeout or a monoflop is over; 0: it does not
};

/// The pauses of a clock, as its first changes show them.
struct ClockRests {
  Tick half_period = 0;
  Tick longest = 0;
  std::vector<Tick> pauses;  // a clock that rests for longer ends a word: first three periods, then one between each
                             // two lengths of its rests that differ clearly, the shortest first
};

/// Nothing: too few changes.
std::optional<ClockRests> find_rests(const Changes& clock);

/// A part of the capture. `in`, `out` and `select` may be missing.
struct ClockedPart {
  const Changes* clock;
  const Changes* in = nullptr;
  const Changes* out = nullptr;
  const Changes* select = nullptr;
  Tick first = 0;
  Tick end = 0;
};

/// Decodes part after part. A burst whose beginning or end was not seen is marked as cut. A lone change of the clock
/// between two pauses is none: a host holds the clock low, or lets it rise again.
class ClockedDecoder {
 public:
  static constexpr std::size_t most_bits = 65536;  // of a burst; a longer one is cut

  explicit ClockedDecoder(const ClockedFormat& format) : format_(format) {}

  /// What comes next does not follow what was.
  void restart() { *this = ClockedDecoder(format_); }
  void decode(const ClockedPart& part, std::vector<Burst>& bursts);
  /// As decode, where `other`, just restarted, has decoded the same part into `guessed`: what is right of it is taken
  /// over together with its state. The outcome is that of decode, to the bit.
  void join(const ClockedPart& part, ClockedDecoder& other, std::vector<Burst>& guessed, std::vector<Burst>& bursts);
  /// Nothing follows.
  void finish(std::vector<Burst>& bursts);
  /// No burst that is yet to come begins before, where `end` is that of the last part.
  [[nodiscard]] Tick settled(Tick end) const { return open_ ? burst_.begin : end; }

 private:
  // A wire within a part.
  struct Wire {
    bool level = false;
    std::span<const Tick> left{};  // changes to come
    std::optional<Tick> border{};  // one before them, where two parts do not fit

    void begin(const Changes* changes, Tick first, bool known);
    [[nodiscard]] Tick next() const;
    void step();
    bool before(Tick at);  // level just before
  };
  struct Targets {
    std::span<const Burst> bursts;
    const Burst* open;  // not complete yet
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
  void look_for_change(Tick until);
  [[nodiscard]] bool is_over(Tick rest) const;
  void look_behind();

  ClockedFormat format_;
  bool begun_ = false;
  bool has_in_ = false;
  bool has_out_ = false;
  Wire clock_;
  Wire in_;
  Wire out_;
  Wire select_;
  Tick last_ = 0;  // change of the clock, or where the capture began
  bool seen_pause_ = false;
  bool open_ = false;
  bool lone_ = false;     // the clock has changed once in this burst
  bool fell_ = false;     // since the last word the clock has changed once, and rested low
  bool changed_ = false;  // the data line, in this rest
  Burst burst_;
};

}  // namespace absenc::capture
