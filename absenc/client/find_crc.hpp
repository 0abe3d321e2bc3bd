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

/// A complete frame with its check: bytes, or bits with the most significant bit first.
struct CheckedFrame {
  std::vector<std::uint8_t> bytes;  ///< Bytes of the frame, including the checksum.
  std::size_t bits = 0;             ///< Number of bits of a frame on a clocked link; 0: the frame has whole bytes.
};

/// A check that explains the frames. Positions count from 0, in bytes or, for frames of bits, in bits.
struct FoundCheck {
  std::string_view name;  ///< Kind of check: "crc", "sum", "negative_sum" or "xor".
  /// Parameters of a CRC; for the other kinds `init` is the constant of the sum or xor.
  CrcParameters parameters{};
  bool low_first = false;  ///< Whether a check of more than 8 bits is sent with its low byte first.
  bool padded = false;     ///< Whether the check also covers a byte 00 appended to the data.
  /// Whether the frames fit every initial value `init`, each with another `xorout`, and none of these pairs is a usual
  /// one.
  bool init_open = false;
  /// Positions, in the frame, of the bytes or bits that may be the first that the check covers.
  std::vector<std::size_t> first{};
  std::size_t check_size = 0;  ///< Size of the check, in bytes or, for frames of bits, in bits.
  /// Number of bytes or, for frames of bits, bits after the check, up to the end of the frame.
  std::size_t trailing = 0;
  double chance = 1;  ///< Expected number of checks that would explain as many frames with random content, at most 1.
  /// Number of further frames, with other data, that would leave no doubt about the check.
  unsigned frames_to_settle = 0;
};

/// Result of a search for the checksum of frames.
struct CheckFindings {
  std::vector<FoundCheck> checks{};  ///< Checks that explain the frames, the least likely coincidence first.
  std::size_t shortest = 0;          ///< Length of the shortest frame, in bytes or, for frames of bits, in bits.
  std::size_t longest = 0;           ///< Length of the longest frame, in bytes or, for frames of bits, in bits.
  /// Whether the frames contain too little information to list all checks that explain them.
  bool is_open = false;
  /// Number, from 1, of a frame without which a check explains all others beyond doubt; 0: none was found.
  std::size_t odd = 0;
  /// A sentence about open questions or about the failure of the search; may be "".
  std::string advice{};
};

/// Returns checks of 3 to 16 bits that explain every frame. Throws UsageError.
[[nodiscard]] CheckFindings find_crc(std::span<const CheckedFrame> frames);

/// A unit with options that configure it for a found check.
struct CheckOptions {
  const Unit* unit;  ///< Unit whose frames can have the check.
  /// Options that select the check, as "crc_width=16"; empty if the unit's defaults do.
  std::vector<std::string> options;
};

/// Returns the units whose frames can end with this check, with the options that select it. `frame_size` is the length
/// of the shortest frame.
[[nodiscard]] std::vector<CheckOptions> options_for(const FoundCheck& check, std::size_t frame_size, LinkKind link);

}  // namespace absenc::client
