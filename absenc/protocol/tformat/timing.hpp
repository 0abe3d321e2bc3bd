// SPDX-License-Identifier: Apache-2.0
// Times of the T-format and of the encoder behind it, as the host keeps them and the virtual encoder demands them.
#pragma once

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"

namespace absenc::tformat {

using namespace std::chrono_literals;

inline constexpr LineSettings line_settings{.rate = 2'500'000};  // 6.1

inline constexpr Time answer_time = 3us;        // from the request's delimiter to the reply's start bit, typical (8.1)
inline constexpr unsigned reset_requests = 10;  // of one kind in one sequence make a reset (10)
inline constexpr Time reset_interval = 40us;    // at least, between them (10)
inline constexpr std::uint32_t zero_tolerance_millidegrees = 349;  // 0.35 degrees (10): 127 counts of 17 bits
inline constexpr Time memory_time = 18ms;          // at most, for a write, a page change or the zero position (9.1, 10)
inline constexpr Time start_up_with_battery = 1s;  // no request is accepted (5.4)
inline constexpr Time start_up_without_battery = 1500ms;

/// Limits the host waits for; the document gives only the typical answer time.
inline constexpr Time answer_limit = 100us;
inline constexpr Time gap_limit = 3 * line_settings.character();

inline constexpr std::uint8_t user_pages = 6;        // 0 to 5 (6.1.1)
inline constexpr std::uint8_t page_addresses = 127;  // 0 to 126; 127 selects the page
inline constexpr std::uint8_t service_page = 7;
inline constexpr std::uint32_t write_life = 100'000;    // of all bytes together (6.1.1)
inline constexpr std::uint8_t overheat_address = 4;     // on the service page (7.2)
inline constexpr std::uint8_t temperature_address = 5;  // on the service page (7.3)
inline constexpr std::uint8_t overheat_at_shipping = 0xDA;

[[nodiscard]] constexpr bool is_page(unsigned page) { return page < user_pages || page == service_page; }

/// The area open to the user; page select (address 127) is not part of it.
[[nodiscard]] constexpr bool is_open(unsigned page, unsigned address) {
  if (address >= page_addresses) return false;
  if (page < user_pages) return true;
  return page == service_page && (address == overheat_address || address == temperature_address);
}

}  // namespace absenc::tformat
