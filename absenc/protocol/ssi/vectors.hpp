// SPDX-License-Identifier: Apache-2.0
// SSI test words with their sources; "derived": made by the rules of the document.
#pragma once

#include <array>

#include "absenc/protocol/author/text.hpp"

namespace absenc::ssi {

// clang-format off
/// Test frames, each with the fields or the error that decoding must give.
inline constexpr auto vectors = std::to_array<author::VectorText>({
    {"ssi-001", "12 bits", "RAA38S6 manual 3.5", "bits=12", "", "000111101111", "singleturn=495 angle_deg=43.505859375"},
    {"ssi-002", "12 bits at zero", "RAA38S6 manual 3.5", "bits=12", "", "000000000000", "singleturn=0 angle_deg=0.0"},
    {"ssi-003", "the word read twice", "RAA38S6 manual 3.5", "bits=12 extra_clocks=12", "", "000111101111000111101111", "singleturn=495 angle_deg=43.505859375"},
    {"ssi-004", "the word read twice, one bit differs", "derived", "bits=12 extra_clocks=12", "", "000111101111000111101110", "cross_check_failed"},
    {"ssi-005", "14 clocks: thousands of degrees", "RAA38S6 manual 3.5", "bits=12", "", "11110000111111", "out_of_range"},
    {"ssi-006", "14 clocks: as one number it could be a position", "RAA38S6 manual 3.5", "bits=12", "", "00011110111100", "wrong_length"},
    {"ssi-007", "8 clocks", "RAA38S6 manual 3.5", "bits=12", "", "00011110", "wrong_length"},
    {"ssi-008", "Gray code over 4 bits of turns and 13 bits", "derived", "bits=13 multiturn_bits=4 gray=true", "", "01110101100101110", "multiturn=5 singleturn=0x1234 angle_deg=204.78515625"},
    {"ssi-009", "Gray code, error bit active low", "derived", "bits=13 gray=true error_bit=active_low", "", "11011001011100", "singleturn=0x1234 angle_deg=204.78515625 error=1"},
    {"ssi-010", "error bit and even parity", "derived", "bits=13 error_bit=active_high parity=even", "", "100100011010010", "singleturn=0x1234 angle_deg=204.78515625 error=1"},
    {"ssi-011", "error bit and odd parity", "derived", "bits=13 error_bit=active_high parity=odd", "", "100100011010011", "singleturn=0x1234 angle_deg=204.78515625 error=1"},
    {"ssi-012", "odd parity where even is expected", "derived", "bits=13 error_bit=active_high parity=even", "", "100100011010011", "bad_checksum"},
    {"ssi-013", "a zero follows the word", "derived", "bits=12 after_word=zero extra_clocks=1", "", "0001111011110", "singleturn=495 angle_deg=43.505859375"},
    {"ssi-014", "nobody drives the line: no zero follows", "derived", "bits=12 after_word=zero extra_clocks=1", "", "1111111111111", "line_stuck"},
    {"ssi-015", "more bits than 12: no zero follows the word", "derived", "bits=12 after_word=zero extra_clocks=1", "", "0001111011111", "cross_check_failed"},
    {"ssi-016", "the word again behind a zero", "derived", "bits=12 after_word=separated extra_clocks=13", "", "0001111011110000111101111", "singleturn=495 angle_deg=43.505859375"},
    {"ssi-017", "the word again behind a one", "derived", "bits=12 after_word=separated extra_clocks=13", "", "0001111011111000111101111", "cross_check_failed"},
    {"ssi-018", "tree format of 25 clocks: 4 bits of turns, 10 bits", "derived", "bits=10 multiturn_bits=4 tree_turns=12 tree_steps=13", "", "0000000001010100100011000", "multiturn=5 singleturn=291 angle_deg=102.3046875"},
    {"ssi-019", "a bit in what fills the tree up", "derived", "bits=10 multiturn_bits=4 tree_turns=12 tree_steps=13", "", "0000000001010100100011001", "out_of_range"},
    {"ssi-020", "a parity that tells an error", "derived", "bits=13 parity=error", "", "10010001101001", "singleturn=0x1234 angle_deg=204.78515625 error=0"},
    {"ssi-021", "the same inverted: the position is wrong", "derived", "bits=13 parity=error", "", "10010001101000", "singleturn=0x1234 angle_deg=204.78515625 error=1"},
    {"ssi-022", "power-fail bit behind Gray code, and even parity", "derived", "bits=13 gray=true error_bit=active_high parity=even", "", "110110010111011", "singleturn=0x1234 angle_deg=204.78515625 error=1"},
});
// clang-format on

}  // namespace absenc::ssi
