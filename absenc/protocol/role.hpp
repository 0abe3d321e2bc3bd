// SPDX-License-Identifier: Apache-2.0
// The meaning of a field, an option or an argument for code that knows no protocol. Names are for people: code that
// handles all units never looks up a name.
#pragma once

#include <cstdint>
#include <span>

namespace absenc {

/// A role. The kit finds commands whose fields or arguments lack the roles that they need.
enum class Role : std::uint8_t {
  other,  ///< only its unit uses it
  // Roles in a reading
  position,      ///< field: counts of the position, or the place of a linear encoder
  turns,         ///< field: turns
  of_position,   ///< field: valid as long as the position is: the position in degrees, or of a second channel
  sequence,      ///< field: counts the replies, so that a repeated reply can be detected
  life_counter,  ///< field: counts the frames, 0 to 63 and again from 0, by one for each frame
  // Roles on a line
  encoder,   ///< option, field: which encoder on the line; in a scan it begins a new record
  identity,  ///< field: identifies the encoder: its type, its serial number
  clash,     ///< field of a scan: not 0: every answer at this address is damaged
  trouble,   ///< field of a scan: what is wrong with an answer that was complete
  rate,      ///< option: bits per second
  // Roles of the options of a checksum at the end of a word, which `crc find` finds
  check_width,       ///< bits
  check_polynomial,  ///< polynomial without its highest power
  check_init,        ///< start value
  check_inverted,    ///< whether it is sent inverted
  // Roles in memory, registers and settings
  address,   ///< argument: address of the byte or register
  page,      ///< argument, if there are pages
  count,     ///< argument: bytes to read; without it one byte is read
  force,     ///< argument: 1: also writes a protected byte, or a value that is set already
  value,     ///< argument, field: the byte, or the content of a register, most significant byte first
  data,      ///< field: several bytes, or those of a register
  written,   ///< field: 0: nothing was sent, because the value is set already
  exchange,  ///< field: what was requested and how it was sent; nothing about the encoder
};

/// Returns whether a field of this role is valid only as long as the reading, or a part of it, is.
[[nodiscard]] constexpr bool is_of_reading(Role role) {
  return role == Role::position || role == Role::turns || role == Role::of_position;
}

/// Returns the first of these fields, options or arguments with this role, or null.
template <class Named>
[[nodiscard]] constexpr const Named* find_role(std::span<const Named> all, Role role) {
  for (const Named& one : all) {
    if (one.role == role) return &one;
  }
  return nullptr;
}

}  // namespace absenc
