// SPDX-License-Identifier: Apache-2.0
// Functions on the areas of an encoder's memory.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "absenc/protocol/unit.hpp"

namespace absenc::author {

/// Returns the area that includes the byte at `address` of `page`, or null if no area does.
[[nodiscard]] constexpr const MemoryArea* find_area(std::span<const MemoryArea> areas, unsigned page,
                                                    unsigned address) {
  const auto area =
      std::find_if(areas.begin(), areas.end(), [&](const MemoryArea& each) { return each.has(page, address); });
  return area == areas.end() ? nullptr : &*area;
}

/// Returns whether any of the areas includes the page `page`.
[[nodiscard]] constexpr bool has_page(std::span<const MemoryArea> areas, unsigned page) {
  return std::any_of(areas.begin(), areas.end(), [&](const MemoryArea& each) { return page - each.page < each.pages; });
}

/// Returns the number of bytes of all areas for which `counts(area)` is true. Each area has one page.
template <class Counts>
[[nodiscard]] constexpr std::size_t size_of(std::span<const MemoryArea> areas, Counts counts) {
  std::size_t bytes = 0;
  for (const MemoryArea& area : areas) bytes += counts(area) ? area.count : 0;
  return bytes;
}

/// Returns the offset of a byte in a buffer that has the bytes of all areas for which `counts(area)` is true, one area
/// after the other. Each area has one page, and one of these areas must include the byte.
template <class Counts>
[[nodiscard]] constexpr std::size_t offset_of(std::span<const MemoryArea> areas, unsigned page, unsigned address,
                                              Counts counts) {
  const MemoryArea* const area = find_area(areas, page, address);
  return size_of(areas.first(static_cast<std::size_t>(area - areas.data())), counts) + (address - area->first);
}

}  // namespace absenc::author
