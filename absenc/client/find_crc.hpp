// SPDX-License-Identifier: Apache-2.0
// Finds the CRC or checksum of an unknown encoder from some of its frames.
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

/// A complete frame with its check: bytes, or bits of a clocked link, packed MSB first.
struct CheckedFrame {
  std::vector<std::uint8_t> bytes;  ///< The bytes, with the checksum.
  std::size_t bits = 0;             ///< Number of bits; 0: whole bytes.
};

/// A check that explains the frames. Positions count from 0, in bytes, or in bits for frames of bits.
struct FoundCheck {
  std::string_view name;  ///< Kind of check: "crc", "sum", "negative_sum" or "xor".
  /// Parameters of a CRC; for other checks, the width is 8 and `init` is the constant.
  CrcParameters parameters{};
  bool low_first = false;            ///< Whether the low byte of a check of more than 8 bits comes first.
  bool padded = false;               ///< Whether the check also covers a byte 00 appended to the data.
  bool init_open = false;            ///< All frames have the same length, so that any init fits with a matching xorout.
  std::vector<std::size_t> first{};  ///< Possible positions of the first covered item; coverage ends at the check.
  std::size_t check_size = 0;        ///< Size of the check, in positions.
  std::size_t trailing = 0;          ///< Number of positions after the check.
  double chance = 1;                 ///< Probability that a random check explains the frames as well, at most 1.
  unsigned frames_to_settle = 0;     ///< Number of further frames with other data that would leave no doubt.
};

/// Result of a search for the checksum of frames.
struct CheckFindings {
  std::vector<FoundCheck> checks{};  ///< Checks that explain the frames, the least likely coincidence first.
  std::size_t shortest = 0;          ///< Length of the shortest frame, in positions.
  std::size_t longest = 0;           ///< Length of the longest frame, in positions.
  /// The frames contain too little information to list all checks that explain them.
  bool is_open = false;
  std::size_t odd = 0;   ///< Number, from 1, of the only frame that a check does not explain; 0: none.
  std::string advice{};  ///< A sentence about open questions or about the reason why no check was found; "": neither.
};

/// Returns all checks of 3 to 16 bits that explain every frame. Throws UsageError for fewer than two frames, for bytes
/// and bits together, and for frames that are too short or longer than 64 bytes or 128 bits.
[[nodiscard]] CheckFindings find_crc(std::span<const CheckedFrame> frames);

/// Options that configure a unit for a check.
struct CheckOptions {
  const Unit* unit;                  ///< The unit whose checksum it is.
  std::vector<std::string> options;  ///< Options, as "crc_width=16"; empty if the unit always has this check.
};

/// Returns the units whose words can end with this check. `frame_size` is the length of the shortest frame and `link`
/// the link of the frames.
[[nodiscard]] std::vector<CheckOptions> options_for(const FoundCheck& check, std::size_t frame_size, LinkKind link);

}  // namespace absenc::client
