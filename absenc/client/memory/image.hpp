// SPDX-License-Identifier: Apache-2.0
// Bytes of an encoder's memory by their addresses, in words and in runs.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

struct MemoryAddress {
  std::uint32_t page = 0;
  std::uint32_t address = 0;
  friend constexpr bool operator==(const MemoryAddress&, const MemoryAddress&) = default;
  friend constexpr bool operator<(const MemoryAddress& one, const MemoryAddress& other) {
    return one.page != other.page ? one.page < other.page : one.address < other.address;
  }
};

using MemoryImage = std::map<MemoryAddress, std::uint8_t>;

/// Consecutive addresses of one page.
struct MemoryRun {
  MemoryAddress first;
  std::vector<std::uint8_t> bytes;
};

/// In order; a run ends after `longest` bytes.
[[nodiscard]] std::vector<MemoryRun> runs(const MemoryImage& image, std::size_t longest = SIZE_MAX);

/// What a copy of the unit's memory has; the values are 0.
[[nodiscard]] MemoryImage dump_addresses(const Unit& unit);

/// The bytes of `wanted` that `found` has not, with the values of `wanted`.
[[nodiscard]] MemoryImage differing(const MemoryImage& wanted, const MemoryImage& found);

/// "page 2 address 0x05", or "address 0x05" where there are no pages
[[nodiscard]] std::string to_text(const Unit& unit, MemoryAddress at);

/// "page 0 to 5: 0x00 to 0x7E; page 7: 0x04, 0x06"
[[nodiscard]] std::string addresses_in_words(const Unit& unit, const MemoryImage& image);

enum class Access : std::uint8_t {
  read,
  write,
  force,  // write also what is protected
};

/// Why this address cannot be reached so, or "".
[[nodiscard]] std::string closed(const Unit& unit, MemoryAddress at, Access access);

/// Throws UsageError.
void require_memory(const Unit& unit, Access access);
void require_open(const Unit& unit, const MemoryImage& image, Access access);

}  // namespace absenc::client
