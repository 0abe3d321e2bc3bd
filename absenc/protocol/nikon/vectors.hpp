// SPDX-License-Identifier: Apache-2.0
// Test frames of Nikon's A-format: vendors' examples, and frames made from README.md.
#pragma once

#include <array>
#include <string_view>

#include "absenc/protocol/author/text.hpp"

namespace absenc::nikon {

using author::VectorText;

/// Source of the replies that HPMicro's two sample boards exchange.
inline constexpr std::string_view sei_sample = "hpm_sdk, samples/drivers/sei/master/nikon/README_en.md";
/// Source of a reply of an encoder with 17 bits: a picture that shows the reply's four fields and its CRC.
inline constexpr std::string_view ti_sample = "motor-control-sdk, nikon_sample_output.png";

/// Test frames of the A-format, each with its decoded fields or with the error that decoding gives.
inline constexpr auto vectors = std::array{
    VectorText{"nikon-1", "ST FFFA6, MT 8888, CRC 7A", sei_sample, "", "0200", "0400a6ff8f88085e",
               "encoder_address=0 command=0 encoder_status=0 singleturn=1048486 multiturn=34952"},
    VectorText{"nikon-2", "ST FFFA7, MT 8888, CRC 59", sei_sample, "", "0200", "0400a7ff8f88089a",
               "encoder_address=0 command=0 encoder_status=0 singleturn=1048487 multiturn=34952"},
    VectorText{"nikon-3", "ST FFFAC, MT 8888, CRC 0B", sei_sample, "", "0200", "0400acff8f8808d0",
               "encoder_address=0 command=0 encoder_status=0 singleturn=1048492 multiturn=34952"},
    VectorText{"nikon-4", "the reply before the first sample: IF is 0, CRC A9", sei_sample, "", "0200",
               "0000a5ff8f880895", "bad_framing"},
    VectorText{"nikon-5", "2085 F64A 8009 80, CRC A1: ABS 1526F, 51200 turns", ti_sample, "singleturn_bits=17", "e244",
               "04a16f5201900185", "encoder_address=0 command=4 encoder_status=10 singleturn=86639 multiturn=51200"},
    VectorText{"nikon-6", "encoder 5, with a status bit", "derived", "address=5", "a280", "2c104523710000a5",
               "encoder_address=5 command=0 encoder_status=1 singleturn=74565 multiturn=7"},
    VectorText{"nikon-7", "lower 24 bits", "derived", "", "0281", "440045237116",
               "encoder_address=0 command=1 encoder_status=0 singleturn=74565"},
    VectorText{"nikon-8", "upper 24 bits", "derived", "", "02a2", "840041230102",
               "encoder_address=0 command=2 encoder_status=0 multiturn=4660"},
    VectorText{"nikon-9", "upper 24 bits of 33", "derived", "singleturn_bits=17", "02a2", "840069240074",
               "encoder_address=0 command=2 encoder_status=0 multiturn=4660"},
    VectorText{"nikon-10", "alarms", "derived", "", "0223", "c41003020095",
               "encoder_address=0 command=3 encoder_status=1 alarms=515"},
    VectorText{"nikon-11", "lower 24 bits and alarms", "derived", "", "029b", "c4164523712000e3",
               "encoder_address=0 command=27 encoder_status=1 singleturn=74565 alarms=32"},
    VectorText{"nikon-12", "lower 24 bits and temperature", "derived", "", "02dd", "44074523718e005e",
               "encoder_address=0 command=29 encoder_status=0 singleturn=74565 temperature_c=35.5"},
    VectorText{"nikon-13", "temperature of 35.25 degC", "derived", "", "02af", "c4038d00009d",
               "encoder_address=0 command=15 encoder_status=0 temperature_c=35.25"},
    VectorText{"nikon-14", "identification", "derived", "", "02d0", "0404efcdab23",
               "encoder_address=0 command=16 encoder_status=0 identification=11259375"},
    VectorText{"nikon-15", "identification, highest bit first", "derived", "bit_order=high", "02d0", "0404d5b3f757",
               "encoder_address=0 command=16 encoder_status=0 identification=11259375"},
    VectorText{"nikon-16", "identification of the only encoder, number 5", "derived", "", "0251", "6c04efcdabd2",
               "encoder_address=5 command=17 encoder_status=0 identification=11259375"},
    VectorText{"nikon-17", "word 0x12 of the EEPROM", "derived", "", "020d5a02", "44033c5a128f",
               "encoder_address=0 command=13 encoder_status=0 address=18 value=23100"},
    VectorText{"nikon-18", "word 0x12, highest bit first", "derived", "bit_order=high", "020d5a02", "44035abc1243",
               "encoder_address=0 command=13 encoder_status=0 address=18 value=23101"},
    VectorText{"nikon-19", "word 0xF9: 35.25 degC", "derived", "", "020d3a3f", "44038d00f9c1",
               "encoder_address=0 command=13 encoder_status=0 address=249 value=141"},
    VectorText{"nikon-20", "writing word 0x12", "derived", "", "022eaaa7520b5a02", "84033d5a12f1",
               "encoder_address=0 command=14 encoder_status=0 address=18 value=23101"},
    VectorText{"nikon-21", "writing word 0x12, highest bit first", "derived", "bit_order=high", "022e4a8b92375a02",
               "84035abc123e", "encoder_address=0 command=14 encoder_status=0 address=18 value=23101"},
    VectorText{"nikon-22", "writing the identification", "derived", "", "0272ca4a92665a02", "8404563412e2",
               "encoder_address=0 command=18 encoder_status=0 identification=1193046"},
    VectorText{"nikon-23", "writing the identification of the only encoder, number 5", "derived", "",
               "02f3ca4a92665a02", "ec0456341213",
               "encoder_address=5 command=19 encoder_status=0 identification=1193046"},
    VectorText{"nikon-24", "address 3 for the encoder with an identification", "derived", "", "62d4ca4a92665a02",
               "040556341218", "encoder_address=0 command=20 encoder_status=0 identification=1193046"},
    VectorText{"nikon-25", "clearing the alarms", "derived", "", "0268", "041202000095",
               "encoder_address=0 command=8 encoder_status=1 alarms=2"},
    VectorText{"nikon-26", "address 5 for the only encoder", "derived", "", "a2cb", "c402000000d7",
               "encoder_address=0 command=11 encoder_status=0 alarms=0"},
    VectorText{"nikon-27", "lower 17 bits, which are all", "derived", "singleturn_bits=17", "02b5", "843fa915",
               "encoder_address=0 command=21 encoder_status=0 singleturn=86655"},
    VectorText{"nikon-28", "lower 17 bits of 20, with a status bit", "derived", "", "02b5", "c4aa11b2",
               "encoder_address=0 command=21 encoder_status=1 low_bits=9045"},
    VectorText{"nikon-29", "a wrong checksum", "derived", "", "0200", "0400a6ff8f88085f", "bad_checksum"},
    VectorText{"nikon-30", "a reply to another code", "derived", "", "0223", "440045237116", "unexpected_reply"},
    VectorText{"nikon-31", "a fixed bit is set", "derived", "", "0200", "0408a5ff8f88084b", "unexpected_reply"},
    VectorText{"nikon-32", "a reply of another encoder", "derived", "", "0200", "2c104523710000a5", "unexpected_reply"},
    VectorText{"nikon-33", "a bit above the turns", "derived", "", "0200", "04000000000010e1", "out_of_range"},
    VectorText{"nikon-34", "a bit above the position, without turns", "derived", "multiturn_bits=0", "0281",
               "4400000010bf", "out_of_range"},
    VectorText{"nikon-35", "a bit above the alarms", "derived", "", "0223", "c410030201f1", "out_of_range"},
    VectorText{"nikon-36", "a cut reply", "derived", "", "0200", "0400a6ff8f88", "wrong_length"},
    VectorText{"nikon-37", "a request with a code that no source lists", "derived", "", "0217", "", "unsupported"},
};

}  // namespace absenc::nikon
