// SPDX-License-Identifier: Apache-2.0
// A classic CAN data frame, the item of CAN links.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/bytes.hpp"

namespace absenc {

/// A frame on a CAN bus.
struct CanFrame {
  std::uint32_t id = 0;                ///< identifier: 11 bits, or 29 when `extended`
  bool extended = false;               ///< Whether the identifier has 29 bits.
  bool remote = false;                 ///< Whether it is a remote frame, which has no data.
  std::uint8_t size = 0;               ///< number of data bytes, 0 to 8
  std::array<std::uint8_t, 8> data{};  ///< Data bytes, of which `size` are used.

  /// Returns the data bytes in use.
  [[nodiscard]] constexpr Bytes bytes() const { return {data.data(), size}; }
  /// Compares all members.
  friend constexpr bool operator==(const CanFrame&, const CanFrame&) = default;
};

}  // namespace absenc
