// SPDX-License-Identifier: Apache-2.0
// What a capture holds, from the file up to what was seen on a line: samples or level changes, then characters, bursts
// of clocked bits and CAN frames. Times are ticks of the capture's own clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absenc/link/can.hpp"

namespace absenc::capture {

/// A sample, or a unit of the file's time scale, counted from the beginning of the capture.
using Tick = std::uint64_t;

/// What a file holds.
enum class Content : std::uint8_t {
  samples,  // levels of all channels at a fixed rate
  changes,  // the times at which each channel changed its level
  bytes,    // what a line decoder of another program found
  frames,   // CAN frames
};

struct Layout {
  Content content = Content::samples;
  std::vector<std::string> channels;   // by index; of bytes and frames: the directions or lines they were seen on
  std::uint64_t ticks_per_second = 0;  // 0: the file has no times
  std::uint64_t ticks = 0;             // 0: not known before the end
  // Bytes whose times are those of arrival at a program: Annotator::Settings::gap. 0: the times are those of the line.
  Tick arrival_gap = 0;
};

/// Level changes of one channel. The level alternates, so that the times say it all; they rise strictly.
struct Changes {
  bool before = false;  // the level before the first of them
  std::vector<Tick> at;
};

/// A character of an asynchronous line.
struct Character {
  Tick begin = 0;  // falling edge of the start bit
  Tick end = 0;    // end of the stop bit
  std::uint8_t value = 0;
  std::uint8_t channel = 0;  // index into what was decoded, not into the file's channels
  bool bad_parity = false;
  bool bad_stop = false;  // framing error; with value 0 and a line that stays low: a break
  bool is_break = false;
};

/// A run of clocks: an SPI transfer between two edges of chip select, or a clocked word between two pauses. One that
/// was cut is marked, because a word without its first bits is a plausible wrong position.
struct Burst {
  Tick begin = 0;
  Tick end = 0;
  std::size_t bits = 0;           // clocks seen
  std::vector<std::uint8_t> in;   // what the encoder sent, packed MSB first, the last byte left-aligned
  std::vector<std::uint8_t> out;  // SPI: what the host sent
  bool cut = false;               // its beginning or its end was not seen: bits may be missing there
  // Without chip select:
  bool low_before = false;   // the clock rested at its low level before it
  bool low_after = false;    // and rests there behind it
  bool fell_before = false;  // the clock, high behind the word before, fell in the rest between the two
  bool has_last = false;     // what stood on the line behind the last change of the clock is known
  bool last = false;         // that level of `in`: a host that gives n clocks for n bits takes its last bit there
};

struct CanRecord {
  Tick at = 0;
  CanFrame frame{};
  bool error_frame = false;  // reported by the controller: `frame` holds the kernel's error class and data
  std::uint8_t channel = 0;  // index into the layout's channels
};

/// Where a file stops making sense, and what is wrong there.
struct Damage {
  std::uint64_t offset = 0;  // bytes from the beginning of the file
  Tick tick = 0;             // decoded up to here
  std::string what;          // a sentence; "": none
  bool note = false;         // nothing is missing, but worth to know
};

/// A part of a capture, decoded on its own. Owns its storage, which is used again for the next part.
struct Block {
  std::uint64_t index = 0;            // 0, 1, 2 ... in the order of time
  Tick first = 0;                     // of its first sample, or the time from which its changes count; behind a damage
                                      // it may be later than the end of the block before: nobody knows what was between
  Tick end = 0;                       // one behind its last
  std::vector<std::uint8_t> samples;  // samples: `bytes_per_sample` each, little endian, channel 0 in bit 0
  unsigned bytes_per_sample = 1;      // 1, 2, 4 or 8
  std::vector<Changes> changes;       // changes: one for each channel
  std::vector<Character> bytes;       // bytes
  std::vector<CanRecord> frames;      // frames
  std::uint64_t file_offset = 0;      // for the reader's own use between claim and fill
  std::uint64_t file_size = 0;
};

/// Reads a file as blocks. Memory does not grow with the file.
struct Reader {
  virtual ~Reader() = default;
  [[nodiscard]] virtual const Layout& layout() const = 0;
  /// Takes the next part of the file, in order, one caller at a time. False: no more, or damaged from here on.
  [[nodiscard]] virtual bool claim(Block& block) = 0;
  /// Reads or expands what was claimed; several threads may do so at once, each with a block of its own. A block that
  /// is damaged is cut short.
  virtual void fill(Block& block) = 0;
  /// After the last block: what was wrong with the file, in the order of the file.
  [[nodiscard]] virtual const std::vector<Damage>& damages() const = 0;
};

}  // namespace absenc::capture
