// SPDX-License-Identifier: Apache-2.0
// Decodes a capture to characters or bursts; the number of threads does not change the result.
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

/// A part of a decoded capture: the characters or bursts that were decoded since the previous DecodedPart.
struct DecodedPart {
  Tick end = 0;  // no character or burst of a later DecodedPart begins before this time
  std::span<const Character> characters;
  std::span<const Burst> bursts;
  std::span<const AsyncFormat> formats;  // formats of the asynchronous lines, complete from the first DecodedPart on
};

/// A function that receives the decoded parts of a capture in the order of time; it returns false to end the decoding.
using PartSink = std::function<bool(const DecodedPart& part)>;

struct AsyncLine {
  unsigned channel = 0;  // index of the line's channel in the file
  AsyncSettings settings{};
};

struct AsyncOutcome {
  std::string problem;  // reason why nothing could be decoded, as a sentence; "": none
  std::vector<AsyncFormat> formats;
  // measured baud rate of each line; 0: no good characters, or the file has no times
  std::vector<double> measured_baud;
  std::vector<AsyncDecoder::Statistics> statistics;
};

/// Decodes the characters of several lines, ordered by their start bits; `Character::channel` is the index in `lines`.
/// Memory does not grow with the file. Throws exceptions of the reader and the sink.
AsyncOutcome decode_async(Reader& reader, std::span<const AsyncLine> lines, unsigned threads, const PartSink& sink);

/// The beginning of a capture, split into words at rests longer than `pause`.
struct PauseReading {
  Tick pause = 0;
  bool by_change = false;  // true: a shorter rest also ends a word if the data line changes during the rest
  std::vector<Burst> bursts{};
  // true: the data line changed in every rest that ended a word, as at the end of an encoder's timeout (monoflop)
  bool timed_out = false;
};

struct ClockedLine {
  unsigned clock = 0;
  std::optional<unsigned> in{};      // index of the channel with the encoder's data
  std::optional<unsigned> out{};     // index of the channel with the host's data, for SPI
  std::optional<unsigned> select{};  // index of the channel with chip select, for SPI
  bool rising = false;               // true: the rising edge of the clock samples a bit; false: the falling edge
  bool select_high = false;          // true: chip select is active high
  // without chip select: a rest of the clock longer than this, in ticks, ends a word; 0: `choose` decides
  Tick pause = 0;
  // `settle` and `change_pause` are those of ClockedFormat, but if `pause` is 0, `settle` is measured.
  Tick settle = 0;
  Tick change_pause = 0;
  std::optional<unsigned> direction{};  // index of the channel that is high while the host drives the data line
  bool low_goes_on = false;             // true: a rest of the clock at its low level never ends a word
  // delay of line and transceivers, in ticks: as many more samples are taken behind each word
  Tick delay = 0;
  /// Returns, if `pause` is 0, the index of the PauseReading whose limit decides which rests of the clock end a word.
  /// Null: the limit of three clock periods decides.
  std::function<std::size_t(std::span<const PauseReading>)> choose{};
};

struct ClockedOutcome {
  std::string problem;  // reason why nothing could be decoded, as a sentence; "": none
  Tick pause = 0;       // without chip select: a rest of the clock longer than this, in ticks, ended a word
};

ClockedOutcome decode_clocked(Reader& reader, const ClockedLine& line, unsigned threads, const PartSink& sink);

}  // namespace absenc::capture
