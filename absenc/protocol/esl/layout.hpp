// SPDX-License-Identifier: Apache-2.0
// Tables 3 and 12 as data: the command ids, and which parts each channel of their replies is made of.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>

namespace absenc::esl {

/// Data ID codes of Table 3, and 6 of Tables 6 and 12.
enum class DataId : std::uint8_t {
  position = 1,          // safety
  singleturn = 2,        // safety
  position_short = 4,    // non-safety
  singleturn_short = 5,  // non-safety
  calibration = 6,       // non-safety
  encoder_id = 8,        // never eight times in a row: "dynamic addressing", which nothing describes
  temperature = 9,
  alarms = 0xA,
  zero = 0xB,             // eight times
  clear_alarms = 0xC,     // eight times
  reset_multiturn = 0xD,  // eight times
  read_memory = 0xE,
  write_memory = 0xF,
};

/// What stands behind CF and before the CRC. One byte where no other number is given.
enum class Part : std::uint8_t {
  status,
  alarms,
  singleturn,  // 3 bytes
  multiturn,   // 2 bytes
  sequence,
  encoder_id,
  temperature,
  redundant_sequence,     // 2 bytes: RS0 {RS1, SC2}
  zero_sequence,          // {0, SC2}
  redundant_alone,        // 2 bytes: RS0 RS1 of ID C
  redundant_calibration,  // 2 bytes: RS0 RS1 of ID 6
  memory_address,
  value,
};

[[nodiscard]] constexpr std::size_t size_of(Part part) {
  switch (part) {
    case Part::singleturn:
      return 3;
    case Part::multiturn:
    case Part::redundant_sequence:
    case Part::redundant_alone:
    case Part::redundant_calibration:
      return 2;
    default:
      return 1;
  }
}

struct Layout {
  std::array<Part, 5> parts_one{};
  std::size_t count_one = 0;
  std::array<Part, 4> parts_two{};
  std::size_t count_two = 0;
  std::size_t crc_bytes = 1;
  std::size_t length_one = 0;  // with CF and CRC
  std::size_t length_two = 0;

  [[nodiscard]] constexpr std::span<const Part> one() const { return {parts_one.data(), count_one}; }
  [[nodiscard]] constexpr std::span<const Part> two() const { return {parts_two.data(), count_two}; }
  [[nodiscard]] constexpr bool has_two() const { return count_two != 0; }
  [[nodiscard]] constexpr bool has(Part wanted) const {
    for (const Part part : one()) {
      if (part == wanted) return true;
    }
    for (const Part part : two()) {
      if (part == wanted) return true;
    }
    return false;
  }
};

namespace detail {

constexpr Layout made_of(std::size_t crc_bytes, std::initializer_list<Part> one, std::initializer_list<Part> two = {}) {
  Layout layout{.crc_bytes = crc_bytes, .length_one = 1 + crc_bytes};
  for (const Part part : one) {
    layout.parts_one[layout.count_one++] = part;
    layout.length_one += size_of(part);
  }
  if (two.size() != 0) layout.length_two = 1 + crc_bytes;
  for (const Part part : two) {
    layout.parts_two[layout.count_two++] = part;
    layout.length_two += size_of(part);
  }
  return layout;
}

// Indexed by the id; empty for an id that does not exist.
inline constexpr std::array<Layout, 16> layouts = [] {
  using enum Part;
  std::array<Layout, 16> table{};
  table[0x1] = made_of(2, {status, alarms, singleturn, multiturn, sequence}, {status, alarms, redundant_sequence});
  table[0x2] = made_of(2, {status, alarms, singleturn, sequence}, {status, alarms, redundant_sequence});
  table[0x4] = made_of(1, {status, singleturn, multiturn});
  table[0x5] = made_of(1, {status, singleturn});
  table[0x6] = made_of(1, {status, singleturn}, {status, redundant_calibration});
  table[0x8] = made_of(2, {status, encoder_id, sequence}, {status, encoder_id, zero_sequence});
  table[0x9] = made_of(1, {status, temperature});
  table[0xA] = made_of(1, {status, alarms}, {status, alarms});
  table[0xB] = table[0x2];
  table[0xC] = made_of(1, {status, alarms, singleturn}, {status, alarms, redundant_alone});
  table[0xD] = made_of(1, {status, alarms, multiturn});
  table[0xE] = made_of(1, {memory_address, value});
  table[0xF] = table[0xE];
  return table;
}();

}  // namespace detail

[[nodiscard]] constexpr const Layout& layout_of(DataId id) { return detail::layouts[static_cast<std::size_t>(id)]; }

/// The id of a control field, whatever its parity; nothing for one that the tables do not list.
[[nodiscard]] constexpr std::optional<DataId> data_id(std::uint8_t field) {
  const std::uint8_t id = (field >> 3) & 0xF;
  if (detail::layouts[id].length_one == 0) return std::nullopt;
  return static_cast<DataId>(id);
}

[[nodiscard]] constexpr bool is_memory_access(DataId id) {
  return id == DataId::read_memory || id == DataId::write_memory;
}
[[nodiscard]] constexpr bool is_reset(DataId id) {
  return id == DataId::zero || id == DataId::clear_alarms || id == DataId::reset_multiturn;
}
[[nodiscard]] constexpr bool is_safety_position(DataId id) {
  return id == DataId::position || id == DataId::singleturn;
}
/// Ids whose replies carry the sequence counter (and count it, with sequence_step=safety).
[[nodiscard]] constexpr bool has_sequence(DataId id) { return layout_of(id).crc_bytes == 2; }

[[nodiscard]] constexpr std::size_t reply_length(DataId id) {
  return layout_of(id).length_one + layout_of(id).length_two;
}

}  // namespace absenc::esl
