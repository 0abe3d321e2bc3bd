// SPDX-License-Identifier: Apache-2.0
// The CRC or sum of an unknown encoder, found from a few of its frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/crc.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// A whole frame, its check included: bytes, or of a clocked line bits packed MSB first.
struct CheckedFrame {
  std::vector<std::uint8_t> bytes;  ///< The bytes, with the checksum.
  std::size_t bits = 0;             ///< 0: whole bytes
};

/// One way to check the frames. Positions count bytes, or bits in frames of bits, from 0 on.
struct FoundCheck {
  std::string_view name;             ///< "crc", "sum", "negative_sum", "xor"
  CrcParameters parameters{};        ///< of all but a CRC: width 8, init the constant
  bool low_first = false;            ///< width above 8, in bytes: the check's low byte comes first
  bool padded = false;               ///< one byte 00 counts as covered behind the rest
  bool init_open = false;            ///< all frames have one length: any init fits with an xorout of its own
  std::vector<std::size_t> first{};  ///< each may be the first that is covered; it is covered up to the check
  std::size_t check_size = 0;        ///< how much the check takes
  std::size_t trailing = 0;          ///< what stands behind it
  double chance = 1;                 ///< how often chance would explain the frames as well, at most 1
  unsigned frames_to_settle = 0;     ///< so many more, with other data, would leave no doubt
};

/// Result of a search for the checksum of frames.
struct CheckFindings {
  std::vector<FoundCheck> checks{};  ///< the least likely to be chance first
  std::size_t shortest = 0;          ///< frame, in its positions
  std::size_t longest = 0;           ///< Length of the longest frame, in bytes.
  bool is_open = false;              ///< the frames tell too little to list all that explains them
  std::size_t odd = 0;   ///< 1 for the first: the one frame without which a check explains the others; 0: none
  std::string advice{};  ///< a sentence about what is still open, or why there is nothing; "": nothing is
};

/// All checks of 3 to 16 bits that explain every frame. Throws UsageError when there are fewer than two frames, bytes
/// and bits among them, or one is too short or too long (64 bytes, 128 bits).
[[nodiscard]] CheckFindings find_crc(std::span<const CheckedFrame> frames);

/// How a unit is told of a check.
struct CheckOptions {
  const Unit* unit;                  ///< The unit whose checksum it is.
  std::vector<std::string> options;  ///< "crc_width=16"; none where it has this check anyhow
};

/// The units whose words can have such a check at their end. `frame_size`: of the shortest frame; `link`: of the
/// frames.
[[nodiscard]] std::vector<CheckOptions> options_for(const FoundCheck& check, std::size_t frame_size, LinkKind link);

}  // namespace absenc::client
