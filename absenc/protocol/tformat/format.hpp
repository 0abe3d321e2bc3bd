// SPDX-License-Identifier: Apache-2.0
// Tamagawa T-format (RS-485, 2.5 Mbps, 8N1, LSB first): times, memory, bits, and differences between models. Paragraph
// numbers are those of the TS5700N8500 specification.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/author/memory_map.hpp"

namespace absenc::tformat {

using namespace std::chrono_literals;

inline constexpr LineSettings line_settings{.rate = 2'500'000};  ///< 6.1

inline constexpr Time answer_time = 3us;  ///< from the request's delimiter to the reply's start bit, typical (8.1)
inline constexpr unsigned reset_requests = 10;  ///< consecutive requests of one kind that make a reset (10)
inline constexpr Time reset_interval = 40us;    ///< shortest time between these requests (10)
inline constexpr std::uint32_t zero_tolerance_millidegrees = 349;  ///< 0.35 degrees (10): 127 counts of 17 bits
inline constexpr Time memory_time = 18ms;  ///< longest time of a write, a page change or a new zero position (9.1, 10)
inline constexpr Time start_up_with_battery = 1s;  ///< no request is accepted before (5.4)
/// Time after power-on without a battery until requests are accepted.
inline constexpr Time start_up_without_battery = 1500ms;

/// Time limits of the host; the document states only the typical answer time.
inline constexpr Time answer_limit = 100us;
inline constexpr Time gap_limit = 3 * line_settings.character();  ///< Longest time between two characters of a reply.

inline constexpr std::uint8_t user_pages = 6;               ///< pages 0 to 5 (6.1.1)
inline constexpr std::uint8_t page_addresses = 127;         ///< addresses 0 to 126
inline constexpr std::uint8_t page_select_address = 127;    ///< Address that selects a page.
inline constexpr std::uint8_t service_page = 7;             ///< Page of settings and temperature.
inline constexpr std::uint32_t write_life = 100'000;        ///< writes of all bytes together (6.1.1)
inline constexpr std::uint8_t overheat_address = 4;         ///< on the service page (7.2)
inline constexpr std::uint8_t temperature_address = 5;      ///< on the service page (7.3)
inline constexpr std::uint8_t overheat_at_shipping = 0xDA;  ///< Threshold of over-heat at shipping.
/// Threshold of 0 degC, which 7.4 forbids: 1 degC or more, or a byte below 0x80, which is "off" (7.2.2).
inline constexpr std::uint8_t overheat_at_zero = 0x80;

/// The memory that is open to the user; the page selection is not part of it.
inline constexpr std::array<MemoryArea, user_pages + 2> memory_areas = [] {
  std::array<MemoryArea, user_pages + 2> areas{};
  for (std::uint8_t page = 0; page < user_pages; ++page) {
    areas[page] = {page, 0, page_addresses, "the user's EEPROM", true, true, write_life, {}, true};
  }
  areas[user_pages] = {service_page, overheat_address, 1, "over-heat threshold", true, false, write_life, {}, true};
  areas[user_pages + 1] = {service_page, temperature_address, 1, "temperature", false, false};
  return areas;
}();
/// Returns whether the bytes of an area are stored; the temperature is not.
[[nodiscard]] constexpr bool is_stored(const MemoryArea& area) { return area.writable; }
/// Number of bytes in the stored areas.
inline constexpr std::size_t stored_bytes = author::size_of(memory_areas, is_stored);

/// Returns the area of a byte, null if it is closed.
[[nodiscard]] constexpr const MemoryArea* find_area(unsigned page, unsigned address) {
  return author::find_area(memory_areas, page, address);
}
/// Returns whether the memory has a page.
[[nodiscard]] constexpr bool is_page(unsigned page) { return author::has_page(memory_areas, page); }

/// Data ID codes of Table 1.
enum class DataId : std::uint8_t {
  singleturn = 0,
  multiturn = 1,
  encoder_id = 2,
  everything = 3,
  write_memory = 6,
  clear_alarms = 7,
  zero = 8,
  reset_multiturn = 0xC,
  read_memory = 0xD,
};

/// Bits of the status field SF (6.3.2). The low four are information bits, always 0.
namespace status {
inline constexpr std::uint8_t information = 0x0F;      ///< Status: information.
inline constexpr std::uint8_t counting_error = 0x10;   ///< ea0: the position within the turn is wrong
inline constexpr std::uint8_t alarm = 0x20;            ///< ea1: over-heat, multi-turn error, battery error or alarm
inline constexpr std::uint8_t parity_error = 0x40;     ///< ca0: parity error of the request
inline constexpr std::uint8_t delimiter_error = 0x80;  ///< ca1: delimiter error of the request
inline constexpr std::uint8_t rejected = parity_error | delimiter_error;  ///< Status: rejected.
}  // namespace status

/// Bits of ALMC (Table 3).
namespace alarms {
inline constexpr std::uint8_t over_speed = 0x01;            ///< Alarm: over speed.
inline constexpr std::uint8_t full_absolute_status = 0x02;  ///< Alarm: full absolute status.
inline constexpr std::uint8_t counting_error = 0x04;        ///< Alarm: counting error.
inline constexpr std::uint8_t counter_overflow = 0x08;      ///< Alarm: counter overflow.
inline constexpr std::uint8_t over_heat = 0x10;             ///< Alarm: over heat.
inline constexpr std::uint8_t multiturn_error = 0x20;       ///< Alarm: multiturn error.
inline constexpr std::uint8_t battery_error = 0x40;         ///< Alarm: battery error.
inline constexpr std::uint8_t battery_alarm = 0x80;         ///< Alarm: battery alarm.
/// Alarm: shown in status.
inline constexpr std::uint8_t shown_in_status = over_heat | multiturn_error | battery_error | battery_alarm;
inline constexpr std::uint8_t turns_lost = over_speed | multiturn_error | battery_error;  ///< Alarm: turns lost.
/// Alarms that stay until a reset request; some of them end with power off (6.5).
inline constexpr std::uint8_t latched = over_speed | counter_overflow | over_heat | multiturn_error | battery_error;
/// Alarms that an encoder without a battery always shows: no fault (2 (1), 6.5).
inline constexpr std::uint8_t without_battery = battery_error | battery_alarm;
}  // namespace alarms

/// Contents of a model's frames, and how strictly they are checked.
struct Format {
  unsigned singleturn_bits = 17;  ///< 1 to 24
  unsigned multiturn_bits = 16;   ///< 0 to 24
  int encoder_id = -1;            ///< ENID, 0 to 255; -1: any
  bool strict = true;             ///< also checks that only an encoder true to the specification passes
  bool battery = true;            ///< false: no battery is connected, so the turns are invalid (2 (1))

  /// Returns the settings of the line.
  [[nodiscard]] static constexpr LineSettings line() { return line_settings; }
  /// Returns the bits of the turns that may be used.
  [[nodiscard]] constexpr unsigned turns_bits() const { return battery ? multiturn_bits : 0; }
  /// Returns the bits of position and turns.
  [[nodiscard]] constexpr Resolution resolution() const { return {singleturn_bits, turns_bits()}; }
};

}  // namespace absenc::tformat
