// SPDX-License-Identifier: Apache-2.0
// A classic CAN frame, data or remote: the item of CAN links.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/bytes.hpp"

namespace absenc {

/// A frame on a CAN bus.
struct CanFrame {
  std::uint32_t id = 0;                ///< identifier of the frame: 11 bits, or 29 when `extended`
  bool extended = false;               ///< Whether the identifier has 29 bits.
  bool remote = false;                 ///< Whether the frame is a remote frame, which has no data.
  std::uint8_t size = 0;               ///< number of data bytes, or of requested bytes in a remote frame; 0 to 8
  std::array<std::uint8_t, 8> data{};  ///< data frame: data bytes, of which the first `size` are used

  /// Returns the first `size` data bytes.
  [[nodiscard]] constexpr Bytes bytes() const { return {data.data(), size}; }
  /// Returns whether all members of two frames are equal.
  friend constexpr bool operator==(const CanFrame&, const CanFrame&) = default;
};

}  // namespace absenc
