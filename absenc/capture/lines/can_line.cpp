// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/lines/can_line.hpp"

#include <algorithm>
#include <cmath>

namespace absenc::capture {

namespace {

constexpr unsigned integration_bits = 11;  // number of consecutive recessive bits that mean an idle bus
constexpr unsigned most_equal = 5;         // number of equal bits after which a stuff bit of the other level follows
constexpr std::size_t crc_bits = 15;
constexpr std::uint32_t protocol_error = 0x08, nobody_acknowledged = 0x20;
constexpr std::uint32_t bus_off = 0x40, arbitration_lost = 0x02, controller = 0x04;
constexpr std::uint8_t stuffing = 0x04, form = 0x02, in_crc = 0x08, in_end = 0x1A;

std::uint16_t crc_of(const std::vector<bool>& bits, std::size_t count) {
  std::uint16_t crc = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const bool feedback = ((crc & 0x4000) != 0) != bits[i];
    crc = static_cast<std::uint16_t>((crc << 1 & 0x7FFF) ^ (feedback ? 0x4599 : 0));
  }
  return crc;
}

}  // namespace

std::string_view text_of_error(const CanFrame& error) {
  if ((error.id & bus_off) != 0) return "a controller is bus-off: too many of its frames were destroyed";
  if ((error.id & nobody_acknowledged) != 0) return "nobody acknowledged the frame: is another node on the bus?";
  if ((error.id & protocol_error) != 0) {
    if ((error.data[2] & stuffing) != 0)
      return "six equal bits where five are the most: a destroyed frame, or another bit rate";
    if (error.data[3] == in_crc) return "the CRC of a frame is wrong";
    return "a bit of a frame is not what it must be";
  }
  if ((error.id & arbitration_lost) != 0) return "a controller lost the arbitration";
  if ((error.id & controller) != 0) return "a controller has counted many errors, or lost frames";
  return "an error on the bus";
}

void CanDecoder::decode(const Changes& part, Tick first, Tick end, std::vector<CanRecord>& frames) {
  if (first != end_) {
    finish(frames);
    level_since_ = first;
    bits_taken_ = 0;
    recessive_ = 0;
    state_ = State::waiting;
  }
  if (part.before != level_) change(first, frames);
  for (const Tick at : part.at) change(at, frames);
  end_ = end;
}

void CanDecoder::change(Tick at, std::vector<CanRecord>& frames) {
  level_for(level_, level_since_, at, frames);
  level_ = !level_;
  level_since_ = at;
  bits_taken_ = 0;
}

void CanDecoder::finish(std::vector<CanRecord>& frames) {
  if (end_ > level_since_) level_for(level_, level_since_, end_, frames);
  level_since_ = end_;
  // A frame that is cut off by the end of the capture is no bus error.
  if (state_ == State::stuffed || state_ == State::tail) state_ = State::waiting;
}

// Handles a level that lasted from `from` to `to`. Only the first 32 bits of a long level matter.
void CanDecoder::level_for(bool level, Tick from, Tick to, std::vector<CanRecord>& frames) {
  constexpr double enough = 32;
  const double bits = std::min(static_cast<double>(to - from) / bit_, enough);
  const auto count = static_cast<std::size_t>(std::lround(bits));
  for (; bits_taken_ < count; ++bits_taken_)
    take(level, from + static_cast<Tick>(static_cast<double>(bits_taken_) * bit_), frames);
}

void CanDecoder::take(bool bit, Tick at, std::vector<CanRecord>& frames) {
  recessive_ = bit ? recessive_ + 1 : 0;
  switch (state_) {
    case State::waiting:
      if (recessive_ >= integration_bits) state_ = State::idle;
      break;
    case State::idle:
      if (bit) break;
      state_ = State::stuffed;
      record_ = {.at = at};
      bits_.assign(1, false);
      before_ = false;
      run_ = 1;
      length_ = 0;
      break;
    case State::stuffed:
      take_stuffed(bit, frames);
      break;
    case State::tail:
      take_tail(bit, frames);
      break;
  }
}

void CanDecoder::take_stuffed(bool bit, std::vector<CanRecord>& frames) {
  const bool stuff_bit = run_ == most_equal;
  if (stuff_bit && bit == before_) return fail(protocol_error, stuffing, 0, frames);
  run_ = bit == before_ ? run_ + 1 : 1;
  before_ = bit;
  if (!stuff_bit) {
    bits_.push_back(bit);
    interpret();
  }
  // The last bit of the CRC may be followed by a stuff bit.
  if (length_ == 0 || bits_.size() < length_ || run_ == most_equal) return;
  state_ = State::tail;
  tail_ = 0;
}

// Handles a bit after the CRC of a frame. A receiver ignores the last bit of the end of frame.
void CanDecoder::take_tail(bool bit, std::vector<CanRecord>& frames) {
  constexpr unsigned acknowledge = 1, last = 8;
  if (tail_ == acknowledge) {
    if (crc_of(bits_, length_ - crc_bits) != field(length_ - crc_bits, crc_bits)) {
      return fail(protocol_error, 0, in_crc, frames);
    }
    if (bit) return fail(nobody_acknowledged, 0, 0, frames);
  } else if (!bit) {
    return fail(protocol_error, form, in_end, frames);
  }
  if (tail_++ < last) return;
  frames.push_back(record_);
  state_ = State::waiting;
  recessive_ = last;  // the remaining bits of the end of frame and the intermission complete the idle time
}

std::uint32_t CanDecoder::field(std::size_t first, std::size_t count) const {
  std::uint32_t value = 0;
  for (std::size_t i = first; i < first + count; ++i) value = value << 1 | (bits_[i] ? 1u : 0u);
  return value;
}

// Finds the length of a frame. Its bits are: start, 11 bits of identifier, RTR or SRR, IDE; then r0, DLC, or 18 bits of
// identifier, RTR, r1, r0, DLC.
void CanDecoder::interpret() {
  if (length_ != 0 || bits_.size() < 19) return;
  const bool extended = bits_[13];
  const std::size_t header = extended ? 39 : 19;
  if (bits_.size() < header) return;
  CanFrame& frame = record_.frame;
  if (bits_.size() == header) {
    frame.extended = extended;
    frame.id = extended ? field(1, 11) << 18 | field(14, 18) : field(1, 11);
    frame.remote = bits_[extended ? 32 : 12];
    frame.size = static_cast<std::uint8_t>(std::min<std::uint32_t>(field(header - 4, 4), 8));
  }
  const std::size_t data = frame.remote ? 0 : frame.size;
  if (bits_.size() < header + 8 * data) return;
  for (std::size_t i = 0; i < data; ++i) frame.data[i] = static_cast<std::uint8_t>(field(header + 8 * i, 8));
  length_ = header + 8 * data + crc_bits;
}

void CanDecoder::fail(std::uint32_t error_class, std::uint8_t how, std::uint8_t where, std::vector<CanRecord>& frames) {
  record_.frame = {.id = error_class, .size = 8, .data = {0, 0, how, where}};
  record_.error_frame = true;
  frames.push_back(record_);
  state_ = State::waiting;
}

}  // namespace absenc::capture
