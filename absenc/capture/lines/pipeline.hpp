// SPDX-License-Identifier: Apache-2.0
// From a reader to characters or bursts, with any number of threads: what comes out is that of one thread, to the bit.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absenc/capture/lines/async_format.hpp"
#include "absenc/capture/lines/clocked.hpp"
#include "absenc/capture/signal.hpp"

namespace absenc::capture {

/// What was decoded since the part before.
struct Part {
  Tick end = 0;  // nothing that is yet to come begins before
  std::span<const Character> characters;
  std::span<const Burst> bursts;
  std::span<const AsyncFormat> formats;  // of the asynchronous lines, from the first part on
};

/// Called by the calling thread, in the order of time. False: no more is wanted.
using Sink = std::function<bool(const Part& part)>;

struct AsyncLine {
  unsigned channel = 0;  // of the file
  AsyncSettings settings{};
};

struct AsyncOutcome {
  std::string problem;  // a sentence: nothing could be decoded; "": none
  std::vector<AsyncFormat> formats;
  std::vector<double> measured_baud;  // over the whole capture; 0: no good character, or a file without times
  std::vector<AsyncDecoder::Statistics> statistics;
};

/// Characters of some lines, each marked with its index in `lines`, by the time of their start bits. What is not known
/// of a line is found from its first 16384 changes; a line that has too few takes the baud rate of another. Memory does
/// not grow with the file. Throws what the reader throws.
AsyncOutcome decode_async(Reader& reader, std::span<const AsyncLine> lines, unsigned threads, const Sink& sink);

/// The beginning of a capture, as it reads when a clock that rests for longer than `pause` ends a word.
struct PauseReading {
  Tick pause = 0;
  bool by_change = false;  // and one that is shorter, too, if the data line changes in it
  std::vector<Burst> bursts{};
  bool timed_out = false;  // the data line changed in every rest that ended a word: a timeout or a monoflop was over
};

struct ClockedLine {
  unsigned clock = 0;
  std::optional<unsigned> in{};      // what the encoder sends
  std::optional<unsigned> out{};     // SPI: what the host sends
  std::optional<unsigned> select{};  // SPI: chip select
  bool rising = false;               // the change of the clock that takes a bit
  bool select_high = false;          // chip select is active high
  Tick pause = 0;                    // without chip select: a clock that rests for longer ends a word; 0: `choose`
  Tick settle = 0;                   // with `pause`: as ClockedFormat has them
  Tick change_pause = 0;
  /// Chooses one of the ways to cut that the beginning of the capture allows, by its index. Null: three periods of the
  /// clock.
  std::function<std::size_t(std::span<const PauseReading>)> choose{};
};

struct ClockedOutcome {
  std::string problem;  // a sentence: nothing could be decoded; "": none
  Tick pause = 0;       // that ended words
};

ClockedOutcome decode_clocked(Reader& reader, const ClockedLine& line, unsigned threads, const Sink& sink);

}  // namespace absenc::capture
