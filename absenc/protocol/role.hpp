// SPDX-License-Identifier: Apache-2.0
// The meaning of a field, an option or an argument for code that knows no protocol.
#pragma once

#include <cstdint>
#include <span>

namespace absenc {

/// Meaning of a field, option or argument for programs that do not know the unit.
enum class Role : std::uint8_t {
  other,  ///< no generic meaning: only the unit uses the value
  // Roles in a reading
  position,  ///< field: counts of the position, or the place of a linear encoder
  turns,     ///< field: number of turns
  /// Field: valid only while the position is, such as the position in degrees.
  of_position,
  sequence,      ///< field: counts the replies, so that a repeated reply can be detected
  life_counter,  ///< field: counts the frames, 0 to 63 and again from 0, by one for each frame
  // Roles on a line
  encoder,   ///< option, field: address of the encoder on the line; in a scan this field begins a new record
  identity,  ///< field: identifies the encoder or its interface: type, serial number
  clash,     ///< field of a scan: not 0: answers at this address are damaged, or from two encoders
  trouble,   ///< field of a scan: text about the fault of a complete reply, for example a refusal
  rate,      ///< option: bit rate; its choices are bits per second
  // Roles of the options of a checksum at the end of a word, which `crc find` finds
  check_width,       ///< option: width of the checksum in bits
  check_polynomial,  ///< option: polynomial of the checksum without its highest power
  check_init,        ///< option: start value of the checksum
  check_inverted,    ///< option: whether the checksum is sent inverted
  // Roles in memory, registers and settings
  address,   ///< argument: address of the byte, word or register
  page,      ///< argument: page of the byte, if the memory has pages
  count,     ///< argument: how many bytes, words or registers to read; commands without it read one
  force,     ///< argument: 1 also writes a protected byte, or a value that the encoder has already
  value,     ///< argument, field: the byte or word, or a register's content, most significant byte first
  data,      ///< field: several bytes of memory, or the bytes of a register
  written,   ///< field: 0 if nothing was written, because the encoder has the value already
  exchange,  ///< field: a part of the request or of its encoding, which says nothing about the encoder's state
};

/// Returns whether a field with this role is the position, is the turns, or has a value that is valid only while the
/// position is valid.
[[nodiscard]] constexpr bool is_of_reading(Role role) {
  return role == Role::position || role == Role::turns || role == Role::of_position;
}

/// Returns the first of `all` (fields, options or arguments) with the role `role`, or null.
template <class Named>
[[nodiscard]] constexpr const Named* find_role(std::span<const Named> all, Role role) {
  for (const Named& one : all) {
    if (one.role == role) return &one;
  }
  return nullptr;
}

}  // namespace absenc
