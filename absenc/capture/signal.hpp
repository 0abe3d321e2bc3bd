// SPDX-License-Identifier: Apache-2.0
// Data types of a capture, from the content of the file (samples or level changes) to the decoded line: characters,
// bursts of clocked bits and CAN frames. Times are ticks of the capture's own clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absenc/link/can.hpp"

namespace absenc::capture {

/// A time in samples, or in units of the file's time scale, from the beginning of the capture.
using Tick = std::uint64_t;

/// Kind of data in a capture file.
enum class Content : std::uint8_t {
  samples,  // levels of all channels at a fixed rate
  changes,  // times at which each channel changed its level
  bytes,    // characters that the line decoder of another program found
  frames,   // CAN frames with their times
};

struct Layout {
  Content content = Content::samples;
  std::vector<std::string> channels;   // names by index; for bytes and frames: the directions or lines on which they
                                       // were recorded
  std::uint64_t ticks_per_second = 0;  // 0: the file has no times
  std::uint64_t ticks = 0;             // length of the capture; 0: not known before its end
  // Set if the times of bytes are those of their arrival at a program: see Annotator::Settings::gap. 0: times on the
  // line.
  Tick arrival_gap = 0;
};

/// Level changes of one channel. The level alternates, so the times suffice; they are strictly increasing.
struct Changes {
  bool before = false;  // level before the first change
  std::vector<Tick> at;
};

/// A character of an asynchronous line.
struct Character {
  Tick begin = 0;  // falling edge of the start bit
  Tick end = 0;    // end of the stop bit
  std::uint8_t value = 0;
  std::uint8_t channel = 0;  // index into the decoded channels, not the file's channels
  bool bad_parity = false;
  bool bad_stop = false;  // framing error; with value 0 and a line that stays low it is a break
  bool is_break = false;
};

/// A sequence of clocks: an SPI transfer between two edges of chip select, or a clocked word between two pauses. An
/// incomplete burst is marked, because a word without its first bits looks like a valid wrong position.
struct Burst {
  Tick begin = 0;
  Tick end = 0;
  std::size_t bits = 0;           // number of clocks in the burst
  std::vector<std::uint8_t> in;   // bits sent by the encoder, packed MSB first, the last byte left-aligned
  std::vector<std::uint8_t> out;  // SPI: bits sent by the host, packed like `in`
  bool cut = false;               // its beginning or its end is not in the capture: bits may be missing there
  // The members below apply to clocked words without chip select.
  bool low_before = false;   // the clock rested at its low level before the burst
  bool low_after = false;    // the clock rests at its low level after the burst
  bool fell_before = false;  // the clock, high behind the previous word, fell during the rest between the two words
  bool has_last = false;     // the level of `in` behind the last clock change is known
  bool last = false;         // that level: a host that gives n clocks for n bits takes its last bit there
};

struct CanRecord {
  Tick at = 0;
  CanFrame frame{};
  bool error_frame = false;  // error reported by the controller: `frame` holds the kernel's error class and data
  std::uint8_t channel = 0;  // index into the layout's channels
};

/// A problem in a capture file, with its place.
struct Damage {
  std::uint64_t offset = 0;  // bytes from the beginning of the file
  Tick tick = 0;             // data before this tick was decoded
  std::string what;          // description of the problem as a sentence; "": none
  bool note = false;         // no data is missing, but the user should know this
};

/// A part of a capture that is decoded on its own. It owns its storage, which is used again for the next part.
struct Block {
  std::uint64_t index = 0;  // 0, 1, 2 ... in the order of time
  Tick first = 0;  // tick of the first sample, or time from which the changes are valid; after damage it may be later
                   // than the end of the previous block, because the data between them is missing
  Tick end = 0;    // tick behind the last one
  std::vector<std::uint8_t> samples;  // samples: `bytes_per_sample` bytes each, little endian, channel 0 in bit 0
  unsigned bytes_per_sample = 1;      // 1, 2, 4 or 8
  std::vector<Changes> changes;       // changes: one entry for each channel
  std::vector<Character> bytes;       // the characters of a capture of kind bytes
  std::vector<CanRecord> frames;      // the CAN frames of a capture of kind frames
  std::uint64_t file_offset = 0;      // private to the reader, between `claim` and `fill`
  std::uint64_t file_size = 0;
};

/// Reads a capture file block by block. Memory does not grow with the file.
struct Reader {
  virtual ~Reader() = default;
  [[nodiscard]] virtual const Layout& layout() const = 0;
  /// Claims the next part of the file, in order, by one caller at a time. Returns false at the end or if the file is
  /// damaged from here on.
  [[nodiscard]] virtual bool claim(Block& block) = 0;
  /// Reads or decompresses the claimed part. Several threads may call it at once, each with its own block. A damaged
  /// block is cut short.
  virtual void fill(Block& block) = 0;
  /// Returns the problems found in the file, in the order of the file; complete after the last block.
  [[nodiscard]] virtual const std::vector<Damage>& damages() const = 0;
};

}  // namespace absenc::capture
