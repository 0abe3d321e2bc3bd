// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/can_bits.hpp"

#include <array>
#include <cstdint>

namespace absenc::sim {

namespace {

/// The bits of a CAN frame that the CRC covers, and the CRC itself, with stuff bits.
class StuffedBits {
 public:
  /// Begins a frame without bits. If `bits` is not null, all bits that are appended to the frame, and the stuff bits,
  /// are appended to `bits`, too.
  explicit StuffedBits(std::vector<bool>* bits) : bits_(bits) {}

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
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  // Appends a bit of the frame and, after five equal bits, a stuff bit of the other level.
  void put(bool bit) {
    run_ = run_ != 0 && last_ == bit ? run_ + 1 : 1;
    write(bit);
    if (run_ < 5) return;
    write(!bit);
    run_ = 1;
  }
  void write(bool bit) {
    last_ = bit;
    ++count_;
    if (bits_ != nullptr) bits_->push_back(bit);
  }

  std::vector<bool>* bits_;
  std::size_t count_ = 0;
  std::uint16_t crc_ = 0;
  unsigned run_ = 0;  // number of equal bits at the end so far; 0: no bit was appended yet
  bool last_ = false;
};

// The end of a CAN frame: CRC delimiter, acknowledge slot, acknowledge delimiter, then seven recessive bits.
constexpr std::array<bool, 10> end_bits{true, false, true, true, true, true, true, true, true, true};

// Appends the bits of `frame`, up to and including the CRC, to `bits` and returns their number with stuff bits.
std::size_t put_stuffed(const CanFrame& frame, std::vector<bool>* bits) {
  StuffedBits stuffed(bits);
  stuffed.append(false);
  if (frame.extended) {
    stuffed.append(frame.id >> 18, 11);
    stuffed.append(0b11, 2);  // the bits SRR and IDE, which are recessive (1)
    stuffed.append(frame.id & 0x3FFFF, 18);
    stuffed.append(frame.remote);
    stuffed.append(0, 2);  // the reserved bits r1 and r0
  } else {
    stuffed.append(frame.id, 11);
    stuffed.append(frame.remote);
    stuffed.append(0, 2);  // the bits IDE and r0, which are dominant (0)
  }
  stuffed.append(frame.size, 4);
  for (const std::uint8_t byte : frame.remote ? Bytes() : frame.bytes()) stuffed.append(byte, 8);
  stuffed.append(stuffed.crc(), 15);
  return stuffed.count();
}

}  // namespace

std::vector<bool> can_bits(const CanFrame& frame) {
  std::vector<bool> bits;
  put_stuffed(frame, &bits);
  bits.insert(bits.end(), end_bits.begin(), end_bits.end());
  return bits;
}

std::size_t can_bit_count(const CanFrame& frame) { return put_stuffed(frame, nullptr) + end_bits.size(); }

}  // namespace absenc::sim
