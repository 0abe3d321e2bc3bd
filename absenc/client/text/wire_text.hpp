// SPDX-License-Identifier: Apache-2.0
// Parses and prints frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Greatest number of bytes in one line of a dump or of a memory file.
inline constexpr std::size_t bytes_in_line = 16;

/// A frame that owns its bytes.
struct WireFrame {
  std::vector<std::uint8_t> bytes;
  std::size_t bits = 0;
  std::optional<CanFrame> can;

  /// Returns a view of the frame, which is valid as long as this object.
  [[nodiscard]] Frame frame() const;
};

/// Parses a frame, with or without white space between bytes. Throws UsageError.
[[nodiscard]] WireFrame parse_wire_text(LinkKind link, std::string_view what, std::string_view text);

/// Returns a frame as text for people: bytes "1A 00 2B", a CAN frame "1FF:022B", bits "0001 1110".
[[nodiscard]] std::string to_wire_text(LinkKind link, const Frame& frame);
/// Returns a frame as programs read it, as in vectors.json: "1a002b", "1ff:022b", "00011110".
[[nodiscard]] std::string to_compact_wire_text(LinkKind link, const Frame& frame);

/// Returns bytes in hexadecimal for people: "1A 00 2B".
[[nodiscard]] std::string to_hex(Bytes bytes);

}  // namespace absenc::client
