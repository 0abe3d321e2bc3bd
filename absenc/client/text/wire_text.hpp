// SPDX-License-Identifier: Apache-2.0
// Frames as people write them: bytes in hexadecimal, CAN frames as ID:DATA, clocked words as a string of 0 and 1.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Of bytes that are written as text.
inline constexpr std::size_t bytes_in_line = 16;

/// A frame that owns its bytes.
struct WireFrame {
  std::vector<std::uint8_t> bytes;
  std::size_t bits = 0;
  std::optional<CanFrame> can;

  /// Valid as long as this object.
  [[nodiscard]] Frame frame() const;
};

/// Bytes may be separated by spaces and commas and carry 0x. Throws UsageError, which begins with `what` and names the
/// character at fault and its position (from 1).
[[nodiscard]] WireFrame parse_wire_text(LinkKind link, std::string_view what, std::string_view text);

/// For people: "1A 00 2B", "1FF:022B", remote frames "1FF:R8", "0001 1110".
[[nodiscard]] std::string to_wire_text(LinkKind link, const Frame& frame);
/// For programs, as in vectors.json: "1a002b", "1ff:022b", "00011110".
[[nodiscard]] std::string to_compact_wire_text(LinkKind link, const Frame& frame);

/// "1A 00 2B"
[[nodiscard]] std::string to_hex(Bytes bytes);

}  // namespace absenc::client
