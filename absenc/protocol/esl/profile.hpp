// SPDX-License-Identifier: Apache-2.0
// Options of ESL. README.md states how a test with hardware can find the properties that the document leaves open.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "absenc/protocol/author/option.hpp"

namespace absenc::esl {

/// Order in which bits enter a CRC.
enum class CrcBitOrder : std::uint8_t {
  lsb,  ///< bits enter the CRC byte by byte, LSB first, as on the wire
  msb,  ///< bits enter the CRC byte by byte, MSB first
  /// 16-bit words enter the CRC MSB first; an 8-bit CRC is computed as with the value msb.
  word,
};
/// Order of the two bytes of a 16-bit CRC on the wire.
enum class CrcByteOrder : std::uint8_t {
  low,      ///< both channels send the low byte of the CRC first
  high,     ///< both channels send the high byte of the CRC first
  table12,  ///< as Table 12 draws it: low byte first in channel 1, high byte first in channel 2
};
/// Bit, b7 or b0, of a byte in which RS1, the lowest bit of the redundant position, is sent.
enum class RedundantBit : std::uint8_t { b7, b0 };
/// How the sequence counters SC1 and SC2 change from reply to reply.
enum class SequenceStep : std::uint8_t {
  change,   ///< each reply has another counter value than the reply before it
  safety,   ///< the counter counts the replies to data IDs 1, 2, 8 and B
  request,  ///< the counter counts all requests that the encoder accepts
};
/// Bits of the control field (CF) that its parity bit covers: the data ID alone (command), or the encoder address too
/// (all).
enum class ParityScope : std::uint8_t { command, all };
/// Order of the bits in the status field (SF) or the memory address field (ADF): that of the QS35 document, or that of
/// Tamagawa's T-format.
enum class FieldOrder : std::uint8_t { document, tformat };
/// Number of bits of the redundant position in replies to data ID 6.
enum class Id6Redundant : std::uint8_t { bits_16, bits_9 };
/// Reaction of the virtual encoder to a request with a wrong parity or stop bit: it reports the error in its reply, or
/// is silent.
enum class BadRequest : std::uint8_t { report, silent };

/// Properties of an encoder, and how its replies are checked: the options of ESL.
struct Profile {
  CrcBitOrder crc_bit_order = CrcBitOrder::lsb;       ///< Order in which bits enter the CRCs.
  CrcByteOrder crc16_byte_order = CrcByteOrder::low;  ///< Order of the two bytes of 16-bit CRCs on the wire.
  /// Bit in which RS1, the lowest bit of the redundant position, is sent beside the sequence counter SC2.
  RedundantBit rs1_sc2 = RedundantBit::b7;
  SequenceStep sequence_step = SequenceStep::change;  ///< How the sequence counters change from reply to reply.
  /// Bits of the control field (CF) that its parity bit covers: the data ID, or the encoder address too.
  ParityScope parity_scope = ParityScope::command;
  FieldOrder status_order = FieldOrder::document;  ///< Order of the bits in the status field (SF).
  /// Order of the bits in the address field (ADF), which has the memory address and the busy bit.
  FieldOrder memory_address_order = FieldOrder::document;
  bool request_crc = true;  ///< whether every request ends with a CRC; false: only memory requests do
  /// Bit in which RS1, the lowest bit of the redundant position, is sent in replies to data ID C.
  RedundantBit idc_rs1 = RedundantBit::b7;
  Id6Redundant id6_rs = Id6Redundant::bits_16;  ///< Number of bits of the redundant position in replies to data ID 6.

  std::uint8_t address = 0;  ///< address of the encoder on the line (EAD), 0 to 7
  bool turns = true;         ///< whether the encoder counts turns; false: a single-turn encoder
  /// Whether other encoders share the line; if they do, the memory cannot be accessed (Figure 18).
  Sharing bus = sharing_automatic;
  /// whether a position counts as safe only if both channels report forced_test_passed
  bool require_forced_test = false;
  /// Largest permitted difference between the redundant position (RS) and the top 9 bits of the position (ABS), in
  /// 1/512 turn, 0 to 255.
  std::uint8_t redundant_tolerance = 1;
  /// Reaction of the virtual encoder to a request with a wrong parity or stop bit.
  BadRequest bad_request = BadRequest::report;
};

namespace choices {
template <std::size_t count>
using Names = std::array<std::string_view, count>;
inline constexpr Names<3> crc_bit_order{"lsb", "msb", "word"};
inline constexpr Names<3> crc16_byte_order{"low", "high", "table12"};
inline constexpr Names<2> redundant_bit{"b7", "b0"};
inline constexpr Names<3> sequence_step{"change", "safety", "request"};
inline constexpr Names<2> parity_scope{"command", "all"};
inline constexpr Names<2> field_order{"document", "tformat"};
inline constexpr Names<2> id6_rs{"16", "9"};
inline constexpr Names<2> bad_request{"report", "silent"};
}  // namespace choices

namespace detail {
// Declares an option for a property that the document leaves open and that captured frames can show.
template <auto member, class... Choices>
constexpr auto open_option(std::string_view name, std::string_view meaning, const Choices&... choices) {
  return author::probeable(author::option<member>(name, meaning, choices...));
}
}  // namespace detail

/// Table of the options of ESL; those that `probe` finds come first.
inline constexpr auto options = author::OptionsOf{
    detail::open_option<&Profile::crc_bit_order>(
        "crc_bit_order", "which bit of a byte enters the CRC first; word: 16-bit words, MSB first",
        choices::crc_bit_order),
    detail::open_option<&Profile::crc16_byte_order>(
        "crc16_byte_order", "which byte of a 16-bit CRC comes first; table12: low in channel 1, high in channel 2",
        choices::crc16_byte_order),
    detail::open_option<&Profile::rs1_sc2>("rs1_sc2", "where RS1 stands in the byte {RS1, SC2}",
                                           choices::redundant_bit),
    detail::open_option<&Profile::sequence_step>(
        "sequence_step",
        "how the sequence counter moves: change: somehow; safety: by 1 for each reply to IDs 1, 2, 8, B; "
        "request: by 1 for each request",
        choices::sequence_step),
    detail::open_option<&Profile::parity_scope>(
        "parity_scope", "what the parity bit of CF covers; all: the address too", choices::parity_scope),
    detail::open_option<&Profile::status_order>(
        "status_order", "the order of bits in SF; tformat: information, errors, communication errors",
        choices::field_order),
    detail::open_option<&Profile::memory_address_order>(
        "memory_address_order", "the order of bits in ADF; tformat: busy is b7", choices::field_order),
    detail::open_option<&Profile::request_crc>("request_crc",
                                               "whether every request ends in a CRC; memory requests always do"),
    detail::open_option<&Profile::idc_rs1>("idc_rs1", "where RS1 stands in its byte in a reply to ID C",
                                           choices::redundant_bit),
    detail::open_option<&Profile::id6_rs>("id6_rs", "bits of the redundant position in a reply to ID 6",
                                          choices::id6_rs),
    author::with_role<Role::encoder>(author::option<&Profile::address>("address", "EAD of the encoder", 0, 7)),
    author::option<&Profile::turns>(
        "turns", "whether the encoder counts turns (encoder id D8); false: it has one turn (98), and ABM is 0"),
    author::option<&Profile::bus>(
        "bus",
        "several encoders share the line: memory cannot be read or written then; auto: where it is known, as on "
        "a bus of absenc.toml with more than one, in monitor, and of emulate --also",
        sharing_choices),
    author::option<&Profile::require_forced_test>("require_forced_test",
                                                  "a safe position also needs forced_test_passed in both channels"),
    author::option<&Profile::redundant_tolerance>("redundant_tolerance",
                                                  "how far the two channels may differ, in 1/512 turn", 0, 255),
    author::option<&Profile::bad_request>(
        "bad_request", "what the virtual encoder does with a request whose parity or stop bit is wrong",
        choices::bad_request),
};
/// Number of options for properties that the document leaves open.
inline constexpr std::size_t open_options = [] {
  std::size_t count = 0;
  while (options.infos[count].probeable) ++count;
  return count;
}();
/// Greatest number of choices of an option for a property that the document leaves open.
inline constexpr std::size_t most_choices = [] {
  std::size_t most = 0;
  for (std::size_t i = 0; i < open_options; ++i) most = std::max(most, options.infos[i].choices.size());
  return most;
}();

}  // namespace absenc::esl
