// SPDX-License-Identifier: Apache-2.0
// Addresses and memory areas of BiSS registers. Source: BiSS C Protocol Description rev D2.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absenc/protocol/unit.hpp"

namespace absenc::biss::registers {

/// Number of registers of a bank: addresses 0x00 to 0x3F belong to the selected bank.
inline constexpr unsigned bank_size = 0x40;
inline constexpr unsigned bank_select = 0x40;  ///< Address of the register that selects the bank.
/// Address of the register with the bank of the electronic data sheet; value 0: none.
inline constexpr unsigned eds_bank = 0x41;
inline constexpr unsigned profile = 0x42;        ///< Address of the profile of the encoder, two registers.
inline constexpr unsigned serial_number = 0x44;  ///< Address of the serial number, four registers.
/// Address of the first register outside the banks that the maker defines; the last one is 0x77.
inline constexpr unsigned device = 0x48;
inline constexpr unsigned device_id = 0x78;     ///< Address of the device ID, six registers.
inline constexpr unsigned manufacturer = 0x7E;  ///< Address of the manufacturer's two characters.
inline constexpr unsigned end = 0x80;           ///< First address beyond the registers.

/// Returns the size in bytes of the named register at `address`.
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

inline constexpr unsigned most_banks = 256;  ///< Greatest number of banks; an encoder may have fewer, or none.

/// Memory areas: pages are banks, and addresses outside the banks are on page 0.
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

}  // namespace absenc::biss::registers
