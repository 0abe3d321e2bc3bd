// SPDX-License-Identifier: Apache-2.0
// The registers of a BiSS encoder, as its standard profile lays them out. Source: BiSS C Protocol Description rev D2.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc::biss::registers {

inline constexpr unsigned bank_size = 0x40;  // 00 to 3F are those of the selected bank
inline constexpr unsigned bank_select = 0x40;
inline constexpr unsigned eds_bank = 0x41;       // with the electronic data sheet; 0: there is none
inline constexpr unsigned profile = 0x42;        // two, as the device id and the manufacturer
inline constexpr unsigned serial_number = 0x44;  // four
inline constexpr unsigned device = 0x48;         // to 77: the maker's own
inline constexpr unsigned device_id = 0x78;      // six
inline constexpr unsigned manufacturer = 0x7E;
inline constexpr unsigned end = 0x80;

/// Of what has a name: its bytes, from this address on.
[[nodiscard]] constexpr unsigned size_of(unsigned address) {
  switch (address) {
    case profile:
    case manufacturer:
      return 2;
    case serial_number:
      return 4;
    case device_id:
      return 6;
    default:
      return 1;
  }
}

inline constexpr unsigned most_banks = 256;  // an encoder may have fewer, or none

/// Pages are banks; what is behind the banks is on page 0. A copy of the memory is the bank that the user may write:
/// the rest says which encoder it is, and is not for another.
inline constexpr std::array<MemoryArea, 6> areas = [] {
  return std::array<MemoryArea, 6>{{
      {.page = 0, .first = 0, .count = bank_size, .meaning = "bank"},
      {.page = 0, .first = bank_select, .count = 1, .meaning = "bank select", .in_dump = false},
      {.page = 0,
       .first = eds_bank,
       .count = device - eds_bank,
       .meaning = "EDS bank, profile, serial number",
       .writable = false,
       .in_dump = false},
      {.page = 0,
       .first = device,
       .count = device_id - device,
       .meaning = "the maker's own",
       .in_dump = false,
       .protection = "only its maker says what is written there"},
      {.page = 0,
       .first = device_id,
       .count = end - device_id,
       .meaning = "device id, manufacturer",
       .writable = false,
       .in_dump = false},
      {.page = 1,
       .first = 0,
       .count = bank_size,
       .meaning = "bank",
       .in_dump = false,
       .protection = "only its maker says what a bank holds",
       .pages = most_banks - 1},
  }};
}();

/// Null for an address that no bank has.
[[nodiscard]] constexpr const MemoryArea* find_area(unsigned bank, unsigned address) {
  for (const MemoryArea& area : areas) {
    if (area.has(bank, address)) return &area;
  }
  return nullptr;
}

}  // namespace absenc::biss::registers
