// SPDX-License-Identifier: Apache-2.0
// Finds the CRC or sum of an unknown encoder from a few of its frames. The difference of two good frames of equal
// length is a multiple of the CRC's polynomial.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absenc/core/crc.hpp"

namespace absenc::capture {

/// A captured frame: its bytes, or its bits packed MSB first, the last byte left-aligned.
struct CheckedFrame {
  std::vector<std::uint8_t> bytes;
  std::size_t bits = 0;  // number of bits of the frame; 0: it consists of whole bytes
};

/// Limits of the search; callers must refuse frames that are longer.
inline constexpr std::size_t longest_checked_frame = 64;  // longest frame of bytes, in bytes
inline constexpr std::size_t longest_checked_word = 128;  // longest frame of bits, in bits

enum class CheckKind : std::uint8_t {
  crc,
  sum,           // checksum of 8 bits: a constant plus the sum of the bytes
  difference,    // checksum of 8 bits: a constant minus the sum of the bytes
  exclusive_or,  // checksum of 8 bits: exclusive or of a constant and all bytes
};

/// A checksum that explains all frames. Positions and sizes are in bytes, or in bits in frames of bits.
struct CheckSolution {
  CheckKind kind = CheckKind::crc;
  // parameters of the CRC; for other kinds of checksum, the width is 8 and init is the constant
  CrcParameters parameters{};
  bool low_first = false;  // width above 8 in frames of bytes: the checksum's low byte comes first in the frame
  bool padded = false;     // the checksum is computed as if a byte 00 followed the covered part
  // every init fits, each with its own xorout, because all frames have the same length
  bool init_open = false;
  std::vector<std::size_t> first;  // possible positions of the first byte or bit that the checksum covers
  std::size_t check_size = 0;      // number of bytes, or bits in frames of bits, of the checksum
  std::size_t trailing = 0;        // number of bytes, or bits in frames of bits, behind the checksum
  double chance_log2 = 0;          // log2 of the number of solutions like this one that are expected in random frames
};

struct CheckSearch {
  // the solutions, sorted: the one that is least likely to be an accident comes first
  std::vector<CheckSolution> solutions;
  // number of layouts of the checksum (position and size) for which the frames are too few to list solutions
  std::size_t open = 0;
};

/// Returns checksums of 3 to 16 bits that explain every frame. The frames must be all of bytes or all of bits. A
/// checksum that never changes is not accepted.
[[nodiscard]] CheckSearch find_checks(std::span<const CheckedFrame> frames);

/// Returns how many more different frames would reduce the chance that the solution is an accident to one in a million.
[[nodiscard]] unsigned frames_to_settle(const CheckSolution& solution);

}  // namespace absenc::capture
