// SPDX-License-Identifier: Apache-2.0
// What a field, an option or an argument is to those who know no protocol. Names are for people: nobody who walks the
// units looks one of them up by its name.
#pragma once

#include <cstdint>
#include <span>

namespace absenc {

/// The kit finds a command whose fields or arguments lack the roles it needs.
enum class Role : std::uint8_t {
  other,  ///< only its unit knows
  // Of a reading
  position,      ///< field: the counts of the position, or of a linear encoder its place
  turns,         ///< field: the turns
  of_position,   ///< field: what holds as long as the position does: the same in degrees, or of a second channel
  sequence,      ///< field: counts the replies, so that one that was seen before can be told
  life_counter,  ///< field: counts the frames, 0 to 63 and on at 0: that of the next frame is the one behind it
  // Of a line
  encoder,   ///< option, field: which of the encoders on the line; in a scan a new record begins with it
  identity,  ///< field: says which encoder it is: its type, its serial number
  clash,     ///< field of a scan: not 0: whatever answers there is damaged every time
  trouble,   ///< field of a scan: what is wrong with an answer that came whole
  rate,      ///< option: bits a second
  // Of a check at the end of a word, as `crc find` finds one: options
  check_width,       ///< bits
  check_polynomial,  ///< without its highest power
  check_init,        ///< start value
  check_inverted,    ///< whether it is sent inverted
  // Of a memory, of registers, and of settings
  address,   ///< argument: of the byte or register
  page,      ///< argument, where there are pages
  count,     ///< argument: bytes to read; without it one at a time
  force,     ///< argument: 1: also what is protected, or is so already
  value,     ///< argument, field: the byte, or what a register holds, most significant byte first
  data,      ///< field: the bytes, of several or of a register
  written,   ///< field: 0: nothing was sent, because it is so already
  exchange,  ///< field: what was asked for and how it was sent: it says nothing of the encoder
};

/// Whether what has this role holds only as long as the reading, or a part of it, does.
[[nodiscard]] constexpr bool is_of_reading(Role role) {
  return role == Role::position || role == Role::turns || role == Role::of_position;
}

/// The first of these fields, options or arguments with this role, or null.
template <class Named>
[[nodiscard]] constexpr const Named* find_role(std::span<const Named> all, Role role) {
  for (const Named& one : all) {
    if (one.role == role) return &one;
  }
  return nullptr;
}

}  // namespace absenc
