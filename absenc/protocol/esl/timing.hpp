// SPDX-License-Identifier: Apache-2.0
// Times of ESL and of the encoder behind it, and its memory map: as the host keeps them and the virtual encoder
// demands.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/esl/profile.hpp"

namespace absenc::esl {

using namespace std::chrono_literals;

inline constexpr LineSettings line_settings{.rate = 10'000'000};  // Table 1

inline constexpr Time answer_time = 2us;         // from the request to the reply's start bit, typical (Figure 2)
inline constexpr Time position_time = 4300ns;    // from the end bit of CF to the finished position, typical (Figure 2)
inline constexpr unsigned reset_requests = 8;    // of one kind make a reset (Table 4)
inline constexpr Time reset_interval = 40us;     // between them, typical (Table 4)
inline constexpr Time eeprom_read_time = 200us;  // between the two read requests (Figure 3)
inline constexpr Time eeprom_write_time = 6ms;   // Figure 5; Figure 15 asks for 6 to 10 ms
inline constexpr Time eeprom_read_pause = eeprom_read_time + 20us;   // what a host leaves: "more than 200 us"
inline constexpr Time eeprom_write_pause = eeprom_write_time + 1ms;  // "6~10ms" (Figure 15)
inline constexpr Time page_time = 18ms;                              // after a page change (Table 11, note 3)

/// Not in the document: how long the host waits for an answer, and for the next character of one.
inline constexpr Time answer_limit = 20us;
inline constexpr Time gap_limit = 3 * line_settings.character();
/// Not in the document: what a host leaves between a reply and the next request of a scan. A missing start bit ends a
/// frame set, so one bit would do.
inline constexpr Time request_pause = line_settings.bits(2);

/// When the encoder takes a position: that is finished 4.3 us after the end of CF, which one CRC byte may follow.
[[nodiscard]] constexpr Time latch_time(const Profile& profile, Time sent_at) {
  return sent_at - (profile.request_crc ? line_settings.character() : Time{}) + position_time;
}

/// Table 11. `kind` tells how the bytes are reached.
struct MemoryArea {
  enum class Kind : std::uint8_t {
    eeprom,     // two requests read, 6 ms write
    mtp,        // reached like the EEPROM (assumed); 100 000 writes
    registers,  // immediate, lost at power off
  };
  std::uint8_t page;
  std::uint8_t first;
  std::uint8_t last;
  Kind kind;
  bool user;  // may be written without force: all others hold calibration, lock bits or undescribed commands
  const char* meaning;
};

/// The document gives the user area 512 bytes and one page of 127: pages 1 to 3 are assumed.
inline constexpr std::array<MemoryArea, 12> memory_map{{
    {0, 0x00, 0x7E, MemoryArea::Kind::eeprom, true, "user area"},
    {1, 0x00, 0x7E, MemoryArea::Kind::eeprom, true, "user area (assumed)"},
    {2, 0x00, 0x7E, MemoryArea::Kind::eeprom, true, "user area (assumed)"},
    {3, 0x00, 0x7E, MemoryArea::Kind::eeprom, true, "user area (assumed)"},
    {4, 0x00, 0x7E, MemoryArea::Kind::eeprom, false, "IEC table"},
    {5, 0x00, 0x7E, MemoryArea::Kind::eeprom, false, "OAC table"},
    {6, 0x00, 0x0B, MemoryArea::Kind::eeprom, false, "remaining tables, channel 2 offset, temperature offset"},
    {8, 0x00, 0x2F, MemoryArea::Kind::registers, false, "frames of both channels, error info, forced tests"},
    {14, 0x00, 0x0F, MemoryArea::Kind::mtp, false, "MTP 1"},
    {14, 0x10, 0x1F, MemoryArea::Kind::mtp, false, "MTP 2"},
    {14, 0x20, 0x2F, MemoryArea::Kind::registers, false, "calibration and test"},
    {14, 0x30, 0x3F, MemoryArea::Kind::registers, false, "lock bits"},
}};

/// Null for an address that Table 11 does not list.
[[nodiscard]] constexpr const MemoryArea* find_area(unsigned page, unsigned address) {
  for (const MemoryArea& area : memory_map) {
    if (area.page == page && address >= area.first && address <= area.last) return &area;
  }
  return nullptr;
}

[[nodiscard]] constexpr bool is_page(unsigned page) {
  for (const MemoryArea& area : memory_map) {
    if (area.page == page) return true;
  }
  return false;
}

inline constexpr std::uint8_t last_page = 14;
inline constexpr std::uint8_t last_address = 0x7E;
inline constexpr std::uint8_t register_page = 8;          // selected after power on (Table 9)
inline constexpr std::uint8_t error_info_address = 0x1A;  // on the register page (Table 8)
inline constexpr std::uint8_t error_info_led = 0x02;
inline constexpr std::uint8_t error_info_lissajous = 0x08;

}  // namespace absenc::esl
