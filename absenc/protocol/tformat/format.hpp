// SPDX-License-Identifier: Apache-2.0
// Constants of Tamagawa's T-format, and Format. Numbers of paragraphs are those of the TS5700N8500 specification.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/author/memory_map.hpp"

namespace absenc::tformat {

using namespace std::chrono_literals;

inline constexpr LineSettings line_settings{.rate = 2'500'000};  ///< settings of the RS-485 line (6.1)

inline constexpr Time answer_time = 3us;  ///< time from the request's delimiter to the reply's start bit, typical (8.1)
/// Number of consecutive requests with one data ID that make a reset (paragraph 10).
inline constexpr unsigned reset_requests = 10;
inline constexpr Time reset_interval = 40us;  ///< shortest time between the ten requests of a reset (10)
/// Largest position that counts as zero after setting the zero: 0.35 degrees (10), 127 counts of 17 bits.
inline constexpr std::uint32_t zero_tolerance_millidegrees = 349;
inline constexpr Time memory_time = 18ms;  ///< longest time of a write, a page change or a new zero position (9.1, 10)
/// Time after power on with a battery until requests are accepted (5.4).
inline constexpr Time start_up_with_battery = 1s;
/// Time after power on without a battery until requests are accepted (5.4).
inline constexpr Time start_up_without_battery = 1500ms;

/// Longest time that a host waits for the begin of a reply.
inline constexpr Time answer_limit = 100us;
/// Longest time that a host waits between two characters of a reply.
inline constexpr Time gap_limit = 3 * line_settings.character();

inline constexpr std::uint8_t user_pages = 6;             ///< number of the memory pages for users: 0 to 5 (6.1.1)
inline constexpr std::uint8_t page_addresses = 127;       ///< number of addresses of a page for users: 0 to 126
inline constexpr std::uint8_t page_select_address = 127;  ///< memory address whose writing selects a page
inline constexpr std::uint8_t service_page = 7;  ///< memory page of the over-heat threshold and the temperature
/// permitted number of EEPROM writes, for all bytes together (6.1.1)
inline constexpr std::uint32_t write_life = 100'000;
inline constexpr std::uint8_t overheat_address = 4;  ///< address of the over-heat threshold on the service page (7.2)
inline constexpr std::uint8_t temperature_address = 5;  ///< address of the temperature on the service page (7.3)
/// Memory byte of the over-heat threshold at shipping: enabled, 90 degC.
inline constexpr std::uint8_t overheat_at_shipping = 0xDA;
/// Memory byte that enables an over-heat threshold of 0 degC, which 7.4 forbids.
inline constexpr std::uint8_t overheat_at_zero = 0x80;

/// Areas of the memory that users can access; the address that selects the page belongs to no area.
inline constexpr std::array<MemoryArea, user_pages + 2> memory_areas = [] {
  std::array<MemoryArea, user_pages + 2> areas{};
  for (std::uint8_t page = 0; page < user_pages; ++page) {
    areas[page] = {page, 0, page_addresses, "the user's EEPROM", true, true, write_life, {}, true};
  }
  areas[user_pages] = {service_page, overheat_address, 1, "over-heat threshold", true, false, write_life, {}, true};
  areas[user_pages + 1] = {service_page, temperature_address, 1, "temperature", false, false};
  return areas;
}();
/// Returns whether the EEPROM stores the bytes of an area.
[[nodiscard]] constexpr bool is_stored(const MemoryArea& area) { return area.writable; }
/// Number of bytes in the areas that the EEPROM stores.
inline constexpr std::size_t stored_bytes = author::size_of(memory_areas, is_stored);

/// Returns the memory area of the byte at `address` of `page`; null if no area contains it.
[[nodiscard]] constexpr const MemoryArea* find_area(unsigned page, unsigned address) {
  return author::find_area(memory_areas, page, address);
}
/// Returns whether users can access the memory page `page`.
[[nodiscard]] constexpr bool is_page(unsigned page) { return author::has_page(memory_areas, page); }

/// Data ID of a request: the code of what the host asks for, with the values of Table 1.
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

/// Bits of the status field (SF) of replies (6.3.2).
namespace status {
/// mask of the four information bits, which the specification sets to 0
inline constexpr std::uint8_t information = 0x0F;
/// Status bit ea0: the encoder found the position within the turn wrong.
inline constexpr std::uint8_t counting_error = 0x10;
/// Status bit ea1: at least one of over-heat, multi-turn error, battery error and battery alarm is raised.
inline constexpr std::uint8_t alarm = 0x20;
inline constexpr std::uint8_t parity_error = 0x40;  ///< status bit ca0: the request was received with a parity error
/// Status bit ca1: the request was received with a wrong stop bit.
inline constexpr std::uint8_t delimiter_error = 0x80;
/// Mask of the status bits that show that the encoder refused the request.
inline constexpr std::uint8_t rejected = parity_error | delimiter_error;
}  // namespace status

/// Bits of the alarms (ALMC) in a reply to data ID 3 (Table 3, 6.5).
namespace alarms {
/// Alarm: while the power was off, the shaft turned faster than the turn counter follows.
inline constexpr std::uint8_t over_speed = 0x01;
/// Alarm: the encoder was switched on at 100 rpm or more, so only the top 5 bits of the position are valid.
inline constexpr std::uint8_t full_absolute_status = 0x02;
inline constexpr std::uint8_t counting_error = 0x04;    ///< alarm: the encoder found its position within the turn wrong
inline constexpr std::uint8_t counter_overflow = 0x08;  ///< alarm: the turn counter wrapped around
inline constexpr std::uint8_t over_heat = 0x10;         ///< alarm: the encoder is or was hotter than its threshold
/// Alarm: the encoder found that a bit of its turn counter jumped, so the turns are wrong.
inline constexpr std::uint8_t multiturn_error = 0x20;
/// Alarm: the battery was at 2.75 V or less while the power was off, so the turns are lost.
inline constexpr std::uint8_t battery_error = 0x40;
inline constexpr std::uint8_t battery_alarm = 0x80;  ///< alarm: the battery is at 3.1 V or less
/// Mask of the four alarms for which the status field has one common bit, `status::alarm`.
inline constexpr std::uint8_t shown_in_status = over_heat | multiturn_error | battery_error | battery_alarm;
/// Mask of the alarms that make the turns invalid.
inline constexpr std::uint8_t turns_lost = over_speed | multiturn_error | battery_error;
/// Mask of the alarms that stay raised until a reset clears them (6.5).
inline constexpr std::uint8_t latched = over_speed | counter_overflow | over_heat | multiturn_error | battery_error;
/// Mask of the alarms about the battery (paragraphs 2 (1), 6.5).
inline constexpr std::uint8_t without_battery = battery_error | battery_alarm;
}  // namespace alarms

/// Properties of an encoder model that its frames depend on; they are the options of the unit.
struct Format {
  unsigned singleturn_bits = 17;  ///< number of bits of the position within the turn, 1 to 24
  unsigned multiturn_bits = 16;   ///< number of bits of the turns, 0 to 24; 0: single-turn encoder
  int encoder_id = -1;            ///< encoder id (ENID) that replies must carry, 0 to 255; -1: any id is accepted
  /// Whether all checks are made; false leaves some out, for encoders that deviate from the specification.
  bool strict = true;
  bool battery = true;  ///< whether a battery is connected; without one the turns are invalid (paragraph 2 (1))

  /// Returns the settings of the RS-485 line.
  [[nodiscard]] static constexpr LineSettings line() { return line_settings; }
  /// Returns the number of bits of the turns; 0 without a battery.
  [[nodiscard]] constexpr unsigned turns_bits() const { return battery ? multiturn_bits : 0; }
  /// Returns the numbers of bits of position and turns.
  [[nodiscard]] constexpr Resolution resolution() const { return {singleturn_bits, turns_bits()}; }
};

}  // namespace absenc::tformat
