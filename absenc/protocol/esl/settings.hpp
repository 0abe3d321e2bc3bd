// SPDX-License-Identifier: Apache-2.0
// The unit's options as data, and the profile that their values make.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "absenc/protocol/esl/profile.hpp"
#include "absenc/protocol/options.hpp"

namespace absenc::esl {

enum OptionIndex : std::size_t {
  option_crc_bit_order,
  option_crc16_byte_order,
  option_rs1_sc2,
  option_sequence_step,
  option_parity_scope,
  option_status_order,
  option_memory_address_order,
  option_request_crc,
  option_idc_rs1,
  option_id6_rs,
  option_address,
  option_bus,
  option_require_forced_test,
  option_redundant_tolerance,
  option_bad_request,
};

namespace choices {
using Names2 = std::array<std::string_view, 2>;
using Names3 = std::array<std::string_view, 3>;
inline constexpr Names3 crc_bit_order{"lsb", "msb", "word"};
inline constexpr Names3 crc16_byte_order{"low", "high", "table12"};
inline constexpr Names2 redundant_bit{"b7", "b0"};
inline constexpr Names3 sequence_step{"change", "safety", "request"};
inline constexpr Names2 parity_scope{"command", "all"};
inline constexpr Names2 field_order{"document", "tformat"};
inline constexpr Names2 id6_rs{"16", "9"};
inline constexpr Names2 bad_request{"report", "silent"};
}  // namespace choices

/// The first `open_options` are what the document leaves open.
inline constexpr std::size_t open_options = 10;

inline constexpr std::array<Option, 15> options{{
    {.name = "crc_bit_order",
     .meaning = "which bit of a byte enters the CRC first; word: 16-bit words, MSB first",
     .default_value = 0,
     .choices = choices::crc_bit_order,
     .probeable = true},
    {.name = "crc16_byte_order",
     .meaning = "which byte of a 16-bit CRC comes first; table12: low in channel 1, high in channel 2",
     .default_value = 0,
     .choices = choices::crc16_byte_order,
     .probeable = true},
    {.name = "rs1_sc2",
     .meaning = "where RS1 stands in the byte {RS1, SC2}",
     .default_value = 0,
     .choices = choices::redundant_bit,
     .probeable = true},
    {.name = "sequence_step",
     .meaning = "how the sequence counter moves: change: somehow; safety: by 1 for each reply to IDs 1, 2, 8, B; "
                "request: by 1 for each request",
     .default_value = 0,
     .choices = choices::sequence_step,
     .probeable = true},
    {.name = "parity_scope",
     .meaning = "what the parity bit of CF covers; all: the address too",
     .default_value = 0,
     .choices = choices::parity_scope,
     .probeable = true},
    {.name = "status_order",
     .meaning = "the order of bits in SF; tformat: information, errors, communication errors",
     .default_value = 0,
     .choices = choices::field_order,
     .probeable = true},
    {.name = "memory_address_order",
     .meaning = "the order of bits in ADF; tformat: busy is b7",
     .default_value = 0,
     .choices = choices::field_order,
     .probeable = true},
    {.name = "request_crc",
     .meaning = "whether every request ends in a CRC; memory requests always do",
     .default_value = 1,
     .choices = boolean_choices,
     .probeable = true},
    {.name = "idc_rs1",
     .meaning = "where RS1 stands in its byte in a reply to ID C",
     .default_value = 0,
     .choices = choices::redundant_bit,
     .probeable = true},
    {.name = "id6_rs",
     .meaning = "bits of the redundant position in a reply to ID 6",
     .default_value = 0,
     .choices = choices::id6_rs,
     .probeable = true},
    {.name = "address", .meaning = "EAD of the encoder", .default_value = 0, .minimum = 0, .maximum = 7},
    {.name = "bus",
     .meaning =
         "several encoders share the line: memory cannot be read or written then; auto: where it is known, as on "
         "a bus of absenc.toml with more than one, in monitor, and of emulate --also",
     .default_value = sharing_automatic,
     .choices = sharing_choices},
    {.name = "require_forced_test",
     .meaning = "a safe position also needs forced_test_passed in both channels",
     .default_value = 0,
     .choices = boolean_choices},
    {.name = "redundant_tolerance",
     .meaning = "how far the two channels may differ, in 1/512 turn",
     .default_value = 1,
     .minimum = 0,
     .maximum = 255},
    {.name = "bad_request",
     .meaning = "what the virtual encoder does with a request whose parity or stop bit is wrong",
     .default_value = 0,
     .choices = choices::bad_request},
}};
static_assert(options.size() <= maximum_options);

/// Puts one option into the profile.
constexpr void set_option(Profile& profile, std::size_t option, std::int64_t value) {
  switch (option) {
    case option_crc_bit_order:
      profile.crc_bit_order = static_cast<CrcBitOrder>(value);
      break;
    case option_crc16_byte_order:
      profile.crc16_byte_order = static_cast<CrcByteOrder>(value);
      break;
    case option_rs1_sc2:
      profile.rs1_sc2 = static_cast<RedundantBit>(value);
      break;
    case option_sequence_step:
      profile.sequence_step = static_cast<SequenceStep>(value);
      break;
    case option_parity_scope:
      profile.parity_scope = static_cast<ParityScope>(value);
      break;
    case option_status_order:
      profile.status_order = static_cast<FieldOrder>(value);
      break;
    case option_memory_address_order:
      profile.memory_address_order = static_cast<FieldOrder>(value);
      break;
    case option_request_crc:
      profile.request_crc = value != 0;
      break;
    case option_idc_rs1:
      profile.idc_rs1 = static_cast<RedundantBit>(value);
      break;
    case option_id6_rs:
      profile.id6_rs = static_cast<Id6Redundant>(value);
      break;
    case option_address:
      profile.address = static_cast<std::uint8_t>(value);
      break;
    case option_bus:
      profile.bus = value == sharing_yes;
      break;
    case option_require_forced_test:
      profile.require_forced_test = value != 0;
      break;
    case option_redundant_tolerance:
      profile.redundant_tolerance = static_cast<std::uint8_t>(value);
      break;
    case option_bad_request:
      profile.bad_request = static_cast<BadRequest>(value);
      break;
    default:
      break;
  }
}

/// What `set_option` has put there.
[[nodiscard]] constexpr std::int64_t get_option(const Profile& profile, std::size_t option) {
  switch (option) {
    case option_crc_bit_order:
      return static_cast<std::int64_t>(profile.crc_bit_order);
    case option_crc16_byte_order:
      return static_cast<std::int64_t>(profile.crc16_byte_order);
    case option_rs1_sc2:
      return static_cast<std::int64_t>(profile.rs1_sc2);
    case option_sequence_step:
      return static_cast<std::int64_t>(profile.sequence_step);
    case option_parity_scope:
      return static_cast<std::int64_t>(profile.parity_scope);
    case option_status_order:
      return static_cast<std::int64_t>(profile.status_order);
    case option_memory_address_order:
      return static_cast<std::int64_t>(profile.memory_address_order);
    case option_request_crc:
      return profile.request_crc ? 1 : 0;
    case option_idc_rs1:
      return static_cast<std::int64_t>(profile.idc_rs1);
    case option_id6_rs:
      return static_cast<std::int64_t>(profile.id6_rs);
    default:
      return 0;
  }
}

/// From "name=value name=value". Names and values must be those of `options`.
[[nodiscard]] constexpr Profile to_profile(std::string_view text) {
  Profile profile;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(' '));
    text.remove_prefix(one.size() < text.size() ? one.size() + 1 : one.size());
    const std::string_view name = one.substr(0, one.find('='));
    const std::string_view value = one.substr(one.find('=') + 1);
    for (std::size_t i = 0; i < options.size(); ++i) {
      if (options[i].name != name) continue;
      std::int64_t number = value[0] - '0';
      for (std::size_t choice = 0; choice < options[i].choices.size(); ++choice) {
        if (options[i].choices[choice] == value) number = static_cast<std::int64_t>(choice);
      }
      set_option(profile, i, number);
    }
  }
  return profile;
}

}  // namespace absenc::esl
