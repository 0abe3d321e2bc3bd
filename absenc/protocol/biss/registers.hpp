// SPDX-License-Identifier: Apache-2.0
// The registers of a BiSS encoder in its standard profile. Source: BiSS C Protocol Description rev D2.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc::biss::registers {

inline constexpr unsigned bank_size = 0x40;      ///< addresses 00 to 3F belong to the selected bank
inline constexpr unsigned bank_select = 0x40;    ///< Register that selects the bank.
inline constexpr unsigned eds_bank = 0x41;       ///< bank of the electronic data sheet; 0: none
inline constexpr unsigned profile = 0x42;        ///< two registers
inline constexpr unsigned serial_number = 0x44;  ///< four registers
inline constexpr unsigned device = 0x48;         ///< to 77: defined by the maker
inline constexpr unsigned device_id = 0x78;      ///< six registers
inline constexpr unsigned manufacturer = 0x7E;   ///< Name of the maker: two registers.
inline constexpr unsigned end = 0x80;            ///< First address that no register has.

/// Returns the size in bytes of a named register.
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

inline constexpr unsigned most_banks = 256;  ///< an encoder may have fewer banks, or none

/// Memory areas of the commands: pages are banks, and addresses outside the banks are on page 0. A memory dump has only
/// the bank that users may write; the other areas identify the encoder and must not be copied to another one.
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
       .protection = "its values are defined by the maker"},
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
       .protection = "the content of this bank is defined by the maker",
       .pages = most_banks - 1},
  }};
}();

/// Returns the area of an address; null if there is none.
[[nodiscard]] constexpr const MemoryArea* find_area(unsigned bank, unsigned address) {
  for (const MemoryArea& area : areas) {
    if (area.has(bank, address)) return &area;
  }
  return nullptr;
}

}  // namespace absenc::biss::registers
