// SPDX-License-Identifier: Apache-2.0
// What can be set of an ESL encoder, each with the member of the profile that it sets.
#pragma once

#include <array>
#include <string_view>

#include "absenc/protocol/author/option.hpp"
#include "absenc/protocol/esl/profile.hpp"

namespace absenc::esl {

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

/// First those that the document leaves open.
inline constexpr author::OptionsOf options{
    author::probeable(author::option<&Profile::crc_bit_order>(
        "crc_bit_order", "which bit of a byte enters the CRC first; word: 16-bit words, MSB first",
        choices::crc_bit_order)),
    author::probeable(author::option<&Profile::crc16_byte_order>(
        "crc16_byte_order", "which byte of a 16-bit CRC comes first; table12: low in channel 1, high in channel 2",
        choices::crc16_byte_order)),
    author::probeable(author::option<&Profile::rs1_sc2>("rs1_sc2", "where RS1 stands in the byte {RS1, SC2}",
                                                        choices::redundant_bit)),
    author::probeable(author::option<&Profile::sequence_step>(
        "sequence_step",
        "how the sequence counter moves: change: somehow; safety: by 1 for each reply to IDs 1, 2, 8, B; "
        "request: by 1 for each request",
        choices::sequence_step)),
    author::probeable(author::option<&Profile::parity_scope>(
        "parity_scope", "what the parity bit of CF covers; all: the address too", choices::parity_scope)),
    author::probeable(author::option<&Profile::status_order>(
        "status_order", "the order of bits in SF; tformat: information, errors, communication errors",
        choices::field_order)),
    author::probeable(author::option<&Profile::memory_address_order>(
        "memory_address_order", "the order of bits in ADF; tformat: busy is b7", choices::field_order)),
    author::probeable(author::option<&Profile::request_crc>(
        "request_crc", "whether every request ends in a CRC; memory requests always do")),
    author::probeable(author::option<&Profile::idc_rs1>("idc_rs1", "where RS1 stands in its byte in a reply to ID C",
                                                        choices::redundant_bit)),
    author::probeable(author::option<&Profile::id6_rs>("id6_rs", "bits of the redundant position in a reply to ID 6",
                                                       choices::id6_rs)),
    author::with_role<Role::encoder>(author::option<&Profile::address>("address", "EAD of the encoder", 0, 7)),
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

inline constexpr std::size_t option_crc_bit_order = options.find("crc_bit_order");
inline constexpr std::size_t option_sequence_step = options.find("sequence_step");
inline constexpr std::size_t option_parity_scope = options.find("parity_scope");
inline constexpr std::size_t option_request_crc = options.find("request_crc");
inline constexpr std::size_t open_options = options.find("address");

}  // namespace absenc::esl
