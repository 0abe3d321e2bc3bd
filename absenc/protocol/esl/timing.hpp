// SPDX-License-Identifier: Apache-2.0
// Times of ESL and of its encoder, and its memory map, for the host and the virtual encoder.
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

inline constexpr LineSettings line_settings{.rate = 10'000'000};  ///< Table 1

inline constexpr Time answer_time = 2us;       ///< from the request to the reply's start bit, typical (Figure 2)
inline constexpr Time position_time = 4300ns;  ///< from the end bit of CF to the finished position, typical (Figure 2)
inline constexpr unsigned reset_requests = 8;  ///< consecutive requests of one kind that make a reset (Table 4)
inline constexpr Time reset_interval = 40us;   ///< between these requests, typical (Table 4)
inline constexpr Time eeprom_read_time = 200us;  ///< between the two read requests of a byte (Figure 3)
inline constexpr Time eeprom_write_time = 6ms;   ///< Figure 5; Figure 15 demands 6 to 10 ms
inline constexpr Time eeprom_read_pause = eeprom_read_time + 20us;   ///< pause of the host: "more than 200 us"
inline constexpr Time eeprom_write_pause = eeprom_write_time + 1ms;  ///< pause of the host: "6~10ms" (Figure 15)
inline constexpr Time page_time = 18ms;                              ///< after a page change (Table 11, note 3)

/// Time limits of the host for an answer, and for its next character. Not in the document.
inline constexpr Time answer_limit = 20us;
inline constexpr Time gap_limit = 3 * line_settings.character();  ///< Longest time between two characters of a reply.
/// Pause of the host between a reply and its next request. Not in the document: a missing start bit ends a frame set,
/// so one bit would be enough.
inline constexpr Time request_pause = line_settings.bits(2);

/// Returns when the encoder latches a position: it is finished 4.3 us after the end of CF, which one CRC byte may
/// follow.
[[nodiscard]] constexpr Time latch_time(const Profile& profile, Time sent_at) {
  return sent_at - (profile.request_crc ? line_settings.character() : Time{}) + position_time;
}

inline constexpr std::uint8_t page_select_address = 0x7F;   ///< Address that selects a page.
inline constexpr std::uint8_t last_page = 14;               ///< The last page.
inline constexpr std::uint8_t last_address = 0x7E;          ///< The last address of a page.
inline constexpr std::uint8_t register_page = 8;            ///< selected after power on (Table 9)
inline constexpr std::uint8_t error_info_address = 0x1A;    ///< on the register page (Table 8)
inline constexpr std::uint8_t error_info_led = 0x02;        ///< Bit of the error information: LED.
inline constexpr std::uint8_t error_info_lissajous = 0x08;  ///< Bit of the error information: Lissajous figure.

/// Permissible writing cycles (notes 6 and 7 of Table 11); the document does not state whether per byte or in total.
/// They also tell how bytes are accessed: EEPROM by two requests and a write of 6 ms, MTP alike (assumed), registers,
/// which are lost at power off, at once.
namespace life {
inline constexpr std::uint32_t eeprom = 1'000'000;  ///< Writes that the EEPROM withstands.
inline constexpr std::uint32_t mtp = 100'000;       ///< Writes that the MTP memory withstands.
inline constexpr std::uint32_t registers = 0;       ///< Registers that are in no memory: 0, without limit.
}  // namespace life

/// Table 11 in the order of pages. The document gives the user area 512 bytes but one page of 127, so pages 1 to 3 are
/// assumed. All others hold calibration, lock bits or undescribed commands.
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

/// Returns whether an area holds registers, which are lost at power off.
[[nodiscard]] constexpr bool is_register(const MemoryArea& area) { return area.write_life == life::registers; }
/// Returns whether an area survives power off.
[[nodiscard]] constexpr bool is_stored(const MemoryArea& area) { return !is_register(area); }
/// Number of bytes in EEPROM and MTP.
inline constexpr std::size_t stored_bytes = author::size_of(memory_map, is_stored);
/// Number of bytes in the registers.
inline constexpr std::size_t register_bytes = author::size_of(memory_map, is_register);

/// Returns the area of a byte, null if Table 11 does not list it.
[[nodiscard]] constexpr const MemoryArea* find_area(unsigned page, unsigned address) {
  return author::find_area(memory_map, page, address);
}
/// Returns whether the memory has a page.
[[nodiscard]] constexpr bool is_page(unsigned page) { return author::has_page(memory_map, page); }
/// Returns whether the byte is read at once, without the temporary register.
[[nodiscard]] constexpr bool is_immediate(unsigned page, unsigned address) {
  const MemoryArea* const area = find_area(page, address);
  return address == page_select_address || (area != nullptr && is_register(*area));
}

}  // namespace absenc::esl
