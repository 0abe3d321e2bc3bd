// SPDX-License-Identifier: Apache-2.0
// Times of ESL, and the memory map of the QS35 encoder, for the host and the virtual encoder.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/author/memory_map.hpp"
#include "absenc/protocol/esl/profile.hpp"

namespace absenc::esl {

using namespace std::chrono_literals;

inline constexpr LineSettings line_settings{.rate = 10'000'000};  ///< settings of the RS-485 line (Table 1)

/// Time from the end of a request to the reply's start bit, typical (Figure 2).
inline constexpr Time answer_time = 2us;
/// Time from the end bit of the request's control field (CF) to the finished position, typical (Figure 2).
inline constexpr Time position_time = 4300ns;
/// Number of consecutive requests with one data ID that make a reset (Table 4).
inline constexpr unsigned reset_requests = 8;
inline constexpr Time reset_interval = 40us;  ///< time between two of the eight requests of a reset, typical (Table 4)
/// shortest time between the two requests that read a memory byte (Figure 3)
inline constexpr Time eeprom_read_time = 200us;
/// duration of an EEPROM write (Figure 5; Figure 15 demands 6 to 10 ms)
inline constexpr Time eeprom_write_time = 6ms;
/// Pause of the host between the two requests that read a memory byte: "more than 200 us" (Figure 3).
inline constexpr Time eeprom_read_pause = eeprom_read_time + 20us;
/// Pause of the host after an EEPROM write: "6~10ms" (Figure 15).
inline constexpr Time eeprom_write_pause = eeprom_write_time + 1ms;
inline constexpr Time page_time = 18ms;  ///< time that the memory is busy after a page change (Table 11, note 3)

/// Longest time that a host waits for the begin of a reply, assumed: the document states none.
inline constexpr Time answer_limit = 20us;
/// Longest time that a host waits between two characters of a reply.
inline constexpr Time gap_limit = 3 * line_settings.character();
/// Pause of the host between a reply and its next request, assumed: the document states none.
inline constexpr Time request_pause = line_settings.bits(2);

/// Returns the typical latch time of a position whose request ended at `sent_at` (Figure 2).
[[nodiscard]] constexpr Time latch_time(const Profile& profile, Time sent_at) {
  return sent_at - (profile.request_crc ? line_settings.character() : Time{}) + position_time;
}

inline constexpr std::uint8_t page_select_address = 0x7F;  ///< memory address whose writing selects a page
inline constexpr std::uint8_t last_page = 14;              ///< number of the last memory page
/// Last address of a memory page; the address that selects pages does not count.
inline constexpr std::uint8_t last_address = 0x7E;
/// Memory page of registers, which is selected after power on (Table 9).
inline constexpr std::uint8_t register_page = 8;
/// Address of the error information on the register page (Table 8).
inline constexpr std::uint8_t error_info_address = 0x1A;
inline constexpr std::uint8_t error_info_led = 0x02;  ///< bit of the error information: the LED current is out of range
/// Bit of the error information: the Lissajous signals are out of range.
inline constexpr std::uint8_t error_info_lissajous = 0x08;

/// Permitted numbers of writes (notes 6 and 7 of Table 11); 0: no limit.
namespace life {
inline constexpr std::uint32_t eeprom = 1'000'000;  ///< permitted number of writes of the EEPROM
inline constexpr std::uint32_t mtp = 100'000;       ///< permitted number of writes of the MTP memory
inline constexpr std::uint32_t registers = 0;       ///< permitted number of writes of a register: no limit
}  // namespace life

/// Areas of the memory as in Table 11; pages 1 to 3 of the user area are assumed to exist.
inline constexpr std::array<MemoryArea, 12> memory_map = [] {
  const auto area = [](unsigned page, unsigned first, unsigned last, std::uint32_t life, std::string_view meaning) {
    return MemoryArea{.page = page,
                      .first = first,
                      .count = last - first + 1,
                      .meaning = meaning,
                      .in_dump = page == 0,
                      .write_life = life,
                      .protection = page <= 3 ? "" : "what is written there can spoil the encoder"};
  };
  return std::array<MemoryArea, 12>{
      area(0, 0x00, 0x7E, life::eeprom, "user area"),
      area(1, 0x00, 0x7E, life::eeprom, "user area (assumed)"),
      area(2, 0x00, 0x7E, life::eeprom, "user area (assumed)"),
      area(3, 0x00, 0x7E, life::eeprom, "user area (assumed)"),
      area(4, 0x00, 0x7E, life::eeprom, "IEC table"),
      area(5, 0x00, 0x7E, life::eeprom, "OAC table"),
      area(6, 0x00, 0x0B, life::eeprom, "remaining tables, channel 2 offset, temperature offset"),
      area(8, 0x00, 0x2F, life::registers, "frames of both channels, error info, forced tests"),
      area(14, 0x00, 0x0F, life::mtp, "MTP 1"),
      area(14, 0x10, 0x1F, life::mtp, "MTP 2"),
      area(14, 0x20, 0x2F, life::registers, "calibration and test"),
      area(14, 0x30, 0x3F, life::registers, "lock bits"),
  };
}();

/// Returns whether a memory area holds registers, which are lost at power off.
[[nodiscard]] constexpr bool is_register(const MemoryArea& area) { return area.write_life == life::registers; }
/// Returns whether a memory area (EEPROM or MTP) survives power off.
[[nodiscard]] constexpr bool is_stored(const MemoryArea& area) { return !is_register(area); }
/// Number of bytes of the areas in EEPROM and MTP together.
inline constexpr std::size_t stored_bytes = author::size_of(memory_map, is_stored);
/// Number of bytes of the areas with registers together.
inline constexpr std::size_t register_bytes = author::size_of(memory_map, is_register);

/// Returns the memory area of the byte at `address` of `page`; null if no area contains it.
[[nodiscard]] constexpr const MemoryArea* find_area(unsigned page, unsigned address) {
  return author::find_area(memory_map, page, address);
}
/// Returns whether Table 11 lists the memory page `page`.
[[nodiscard]] constexpr bool is_page(unsigned page) { return author::has_page(memory_map, page); }
/// Returns whether access to the byte needs no waiting: it is a register, or the byte that selects pages.
[[nodiscard]] constexpr bool is_immediate(unsigned page, unsigned address) {
  const MemoryArea* const area = find_area(page, address);
  return address == page_select_address || (area != nullptr && is_register(*area));
}

}  // namespace absenc::esl
