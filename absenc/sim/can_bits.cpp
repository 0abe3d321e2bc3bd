// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/can_bits.hpp"

#include <cstdint>

namespace absenc::sim {

namespace {

/// The bits of a frame that are covered by the CRC and, together with the CRC, by bit stuffing.
class StuffedBits {
 public:
  /// Appends the lower `count` bits of `value`, most significant first.
  void append(std::uint32_t value, unsigned count) {
    while (count-- > 0) append((value >> count & 1) != 0);
  }
  void append(bool bit) {
    const bool feedback = ((crc_ & 0x4000) != 0) != bit;
    crc_ = static_cast<std::uint16_t>(crc_ << 1 & 0x7FFF) ^ (feedback ? 0x4599 : 0);
    put(bit);
  }
  [[nodiscard]] std::uint16_t crc() const { return crc_; }

  std::vector<bool> bits;

 private:
  // Behind five equal bits follows a stuff bit of the other level.
  void put(bool bit) {
    run_ = !bits.empty() && bits.back() == bit ? run_ + 1 : 1;
    bits.push_back(bit);
    if (run_ < 5) return;
    bits.push_back(!bit);
    run_ = 1;
  }

  std::uint16_t crc_ = 0;
  unsigned run_ = 0;
};

}  // namespace

std::vector<bool> can_bits(const CanFrame& frame) {
  StuffedBits stuffed;
  stuffed.append(false);
  if (frame.extended) {
    stuffed.append(frame.id >> 18, 11);
    stuffed.append(0b11, 2);  // the recessive bits SRR and IDE
    stuffed.append(frame.id & 0x3FFFF, 18);
    stuffed.append(frame.remote);
    stuffed.append(0, 2);  // the reserved bits r1 and r0
  } else {
    stuffed.append(frame.id, 11);
    stuffed.append(frame.remote);
    stuffed.append(0, 2);  // the dominant bits IDE and r0
  }
  stuffed.append(frame.size, 4);
  for (const std::uint8_t byte : frame.remote ? Bytes() : frame.bytes()) stuffed.append(byte, 8);
  stuffed.append(stuffed.crc(), 15);
  std::vector<bool> bits = std::move(stuffed.bits);
  bits.insert(bits.end(), {true, false, true});  // CRC delimiter, acknowledge slot, acknowledge delimiter
  bits.insert(bits.end(), 7, true);              // the end of frame has seven recessive bits
  return bits;
}

}  // namespace absenc::sim
