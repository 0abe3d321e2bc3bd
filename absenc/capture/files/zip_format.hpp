// SPDX-License-Identifier: Apache-2.0
// Numbers of the format of zip archives: PKWARE's APPNOTE 6.3.10, 4.3.7 to 4.4.9 and 4.5.3.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"

namespace absenc::capture::zip {

constexpr std::uint64_t local_signature = 0x04034B50;
constexpr std::uint64_t directory_signature = 0x02014B50;
constexpr std::uint64_t zip64_end_signature = 0x06064B50;
constexpr std::uint64_t zip64_locator_signature = 0x07064B50;
constexpr std::uint64_t end_signature = 0x06054B50;
constexpr std::size_t local_bytes = 30;
constexpr std::uint64_t in_zip64 = 0xFFFFFFFF;  // value of a size field if the real size is in the zip64 extra field

/// Returns the number that `size` bytes (1 to 8) from offset `at` on contain, least significant byte first.
[[nodiscard]] inline std::uint64_t number(Bytes bytes, std::size_t at, std::size_t size) {
  return load_little_endian(bytes.subspan(at, size));
}

/// Returns the length of a part, which two bytes from offset `at` on contain.
[[nodiscard]] inline std::size_t length_at(Bytes bytes, std::size_t at) {
  return static_cast<std::size_t>(number(bytes, at, 2));
}

}  // namespace absenc::capture::zip
