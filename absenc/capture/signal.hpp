// SPDX-License-Identifier: Apache-2.0
// Data types of a capture: its levels, characters, bursts of clocked bits and CAN frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absenc/link/can.hpp"

namespace absenc::capture {

/// A time in ticks of the capture's own clock.
using Tick = std::uint64_t;

/// Kind of data in a capture file.
enum class Content : std::uint8_t {
  samples,  // levels of all channels at a fixed rate
  changes,  // times at which each channel changed its level
  bytes,    // characters that another program decoded or received, or that were typed
  frames,   // CAN frames with their times
};

struct Layout {
  Content content = Content::samples;
  std::vector<std::string> channels;   // names of the channels; for bytes and frames: of the directions or lines
  std::uint64_t ticks_per_second = 0;  // number of ticks per second; 0: not known
  std::uint64_t ticks = 0;  // length of the capture in ticks; 0: not known before the capture was read to its end
  // shortest pause that the transport did not cause, if bytes have arrival times at a program
  // (Annotator::Settings::gap); 0: they have times on the line
  Tick arrival_gap = 0;
};

/// Level changes of one channel; the level alternates, and the times increase strictly.
struct Changes {
  bool before = false;  // level of the channel before its first change
  std::vector<Tick> at;
};

/// A character of an asynchronous line.
struct Character {
  Tick begin = 0;  // tick at which the start bit begins, as far as known
  Tick end = 0;    // end of the stop bit, as far as known, or an earlier falling edge after the middle of the stop bit
  std::uint8_t value = 0;
  std::uint8_t channel = 0;  // index of the decoded line, or of the channel in a file of bytes
  // Data bits above the eighth. Later decode_async splits such a character into two of one byte each.
  std::uint8_t high = 0;
  bool bad_parity = false;
  // true: the stop bit was 0 (framing error). If the value is 0 and the line stays low, this is a break.
  bool bad_stop = false;
  bool is_break = false;
};

/// A sequence of clocks, between two edges of chip select or between two pauses.
struct Burst {
  Tick begin = 0;
  Tick end = 0;
  std::size_t bits = 0;          // number of clocks in the burst
  std::vector<std::uint8_t> in;  // bits sent by the encoder, packed MSB first, the last byte left-aligned
  // SPI, and bidirectional clocked links with a wire of their own: bits sent by the host, packed like `in`
  std::vector<std::uint8_t> out;
  // true: bits of the burst may be missing at its beginning or end
  bool cut = false;
  // The members from `low_before` to `tail_bits` are used only for clocked words without chip select.
  bool low_before = false;  // the clock rested at its low level before the burst
  bool low_after = false;   // the clock rests at its low level after the burst
  // the clock was high at the end of the previous word, and fell during the rest between the two words
  bool fell_before = false;
  bool has_last = false;  // true: the level behind the last clock change, `last`, is known
  // level behind the last clock change, where a host with one clock per bit takes its last bit
  bool last = false;
  // levels of the encoder's data line one, two ... clock periods after `last`, the first as the highest of `tail_bits`
  std::uint32_t tail = 0;
  std::uint8_t tail_bits = 0;
  // bidirectional clocked links: levels of the direction wire, packed like `in`; empty: it was not captured
  std::vector<std::uint8_t> direction{};
};

struct CanRecord {
  Tick at = 0;
  CanFrame frame{};
  bool error_frame = false;  // an error of the bus: `frame` holds class and data of the kernel's error frames
  std::uint8_t channel = 0;  // index of the bus among the channels of the capture
};

/// A problem in a capture file, with the place in the file.
struct Damage {
  std::uint64_t offset = 0;  // place of the problem in the file, in bytes from its beginning
  Tick tick = 0;             // tick up to which the data was decoded before the damage
  std::string what;          // description of the problem as a sentence; "": none
  bool note = false;  // true: only a remark, for example that columns are left out; false: data is bad or missing
};

/// A part of a capture that is decoded on its own; its storage is used again.
struct Block {
  std::uint64_t index = 0;  // number of the block: 0, 1, 2 ... in the order of time
  // first tick of the block; after damage it may be later than the end of the previous block
  Tick first = 0;
  Tick end = 0;                       // first tick after the block
  std::vector<std::uint8_t> samples;  // samples, `bytes_per_sample` bytes each, little endian, channel 0 in bit 0
  unsigned bytes_per_sample = 1;      // size of a sample in bytes: 1, 2, 4 or 8
  std::vector<Changes> changes;       // for captures of kind changes: the level changes of each channel
  std::vector<Character> bytes;       // for captures of kind bytes: the characters
  std::vector<CanRecord> frames;      // for captures of kind frames: the CAN frames
  // number by which the reader finds the part of the file when `fill` is called, such as an offset
  std::uint64_t file_offset = 0;
  std::uint64_t file_size = 0;
};

/// Reads a capture file block by block. Memory does not grow with the file.
struct Reader {
  virtual ~Reader() = default;
  [[nodiscard]] virtual const Layout& layout() const = 0;
  /// Claims the next part of the file, by one thread at a time; returns false if there is none.
  [[nodiscard]] virtual bool claim(Block& block) = 0;
  /// Reads the part of the file that `claim` has chosen for `block`; threads may fill different blocks at once.
  virtual void fill(Block& block) = 0;
  /// Returns the problems of the file in its order; complete after the last block was filled.
  [[nodiscard]] virtual const std::vector<Damage>& damages() const = 0;
};

}  // namespace absenc::capture
