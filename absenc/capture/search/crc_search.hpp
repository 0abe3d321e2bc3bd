// SPDX-License-Identifier: Apache-2.0
// The CRC or sum of an unknown encoder, found from a few of its frames. The difference of two frames of one length with
// good CRCs knows neither init nor xorout and is a multiple of the polynomial: so is what all differences have in
// common.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absenc/core/crc.hpp"

namespace absenc::capture {

/// A captured frame: its bytes, or its bits packed MSB first.
struct CheckedFrame {
  std::vector<std::uint8_t> bytes;
  std::size_t bits = 0;  // 0: whole bytes
};

/// Bounds of what is searched: longer frames are refused by the caller.
inline constexpr std::size_t longest_checked_frame = 64;  // bytes
inline constexpr std::size_t longest_checked_word = 128;  // bits of a frame of bits

enum class CheckKind : std::uint8_t {
  crc,
  sum,           // 8 bits: constant + sum of the bytes
  difference,    // 8 bits: constant - sum of the bytes
  exclusive_or,  // 8 bits: constant ^ all bytes
};

/// Positions count bytes, or bits in frames of bits; the end of the covered part and the check itself count from the
/// end of the frame, so that they mean the same in frames of all lengths.
struct CheckSolution {
  CheckKind kind = CheckKind::crc;
  CrcParameters parameters{};      // of all but a CRC: width 8, init the constant
  bool low_first = false;          // width above 8, in frames of bytes: the check's low byte comes first
  bool padded = false;             // one byte 00 counts as covered behind the rest
  bool init_open = false;          // all frames have one length: any init fits with an xorout of its own
  std::vector<std::size_t> first;  // each may be the first that is covered
  std::size_t check_size = 0;      // bytes or bits behind what is covered
  std::size_t trailing = 0;        // bytes or bits behind the check
  double chance_log2 = 0;          // how many such solutions chance alone would bring, as a power of two
};

struct CheckSearch {
  std::vector<CheckSolution> solutions;  // the least likely to be chance first
  std::size_t open = 0;  // ways to cover the frames of which they tell too little to list what explains them
};

/// All checks of 3 to 16 bits that explain every frame. The frames are all of bytes or all of bits; those that stand
/// there twice say nothing new. So do bits that never change, alone or with others: what counts is in how many
/// independent ways the frames differ in what is covered. A check that never changes is none.
[[nodiscard]] CheckSearch find_checks(std::span<const CheckedFrame> frames);

/// How many more frames with other data would leave only solutions that are no chance (below one in a million).
[[nodiscard]] unsigned frames_to_settle(const CheckSolution& solution);

}  // namespace absenc::capture
