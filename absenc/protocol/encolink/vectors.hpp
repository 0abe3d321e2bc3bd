// SPDX-License-Identifier: Apache-2.0
// EncoLink test frames with their source; the compiler decodes each of them.
#pragma once

#include <array>
#include <string_view>

#include "absenc/protocol/author/text.hpp"

namespace absenc::encolink {

namespace vector_texts {

using author::VectorText;

inline constexpr std::string_view derived = "derived";
inline constexpr std::string_view vendor = "rls-encolink 1.0.1";
inline constexpr std::string_view single20 = "resolution=20 multiturn_bits=0";
inline constexpr std::string_view ask = "0000";

inline constexpr std::array uart{
    VectorText{"encolink-001", "ST res 17 pos 0", derived, "resolution=17 multiturn_bits=0", ask, "000003d100",
               "singleturn=0 error=0 warning=0 channel2=0"},
    VectorText{"encolink-002", "ST res 17 pos 131071", derived, "resolution=17 multiturn_bits=0", ask, "ffff831500",
               "singleturn=131071 error=0 warning=0 channel2=0"},
    VectorText{"encolink-004", "ST res 19 pos 275096", derived, "resolution=19 multiturn_bits=0", ask, "8653036200",
               "singleturn=275096 error=0 warning=0 channel2=0"},
    VectorText{"encolink-006", "ST res 22 pos 4194303", derived, "resolution=22 multiturn_bits=0", ask, "ffffffa500",
               "singleturn=4194303 error=0 warning=0 channel2=0"},
    VectorText{"encolink-009", "warning bit low", derived, single20, ask, "003e825200",
               "singleturn=1000 error=0 warning=1 channel2=0"},
    VectorText{"encolink-012", "CRC not inverted", derived, single20, ask, "003e833a00", "bad_checksum"},
    VectorText{"encolink-014", "short frame", derived, single20, ask, "003e83c5", "wrong_length"},
    VectorText{"encolink-015", "all zero reply (MISO low): CRC of 00 00 00 is FF", derived, single20, ask, "0000000000",
               "bad_checksum"},
    VectorText{"encolink-016", "all FF reply (MISO high)", derived, single20, ask, "ffffffffff", "bad_checksum"},
    VectorText{"encolink-017", "channel 2 ST 7-byte cycle, status 0x0000, ch3 idle 0x33", derived,
               "resolution=19 multiturn_bits=0", "", "2468a3000033d3",
               "singleturn=74565 error=0 warning=0 status=0 alarms=0 channel3=0x33"},
    VectorText{"encolink-018", "channel 2 MT 9-byte cycle, status 0x0010 temperature", derived,
               "resolution=19 multiturn_bits=16", "", "00072468a3001033e9",
               "singleturn=74565 multiturn=7 error=0 warning=0 status=16 alarms=16 channel3=0x33"},
    VectorText{"encolink-019", "channel 3 byte stream: read 2 bytes at 0x4C (temperature)", derived, "",
               "00cdef89ab5900020000004c05", "", "op=read address=76 length=2"},
    VectorText{"encolink-021", "channel 3 byte stream: write 0x63 (save) to 0x49", derived, "",
               "00cdef89ab580001000000496342", "", "op=write address=73 length=1 data=\x63 value=0x63"},
    VectorText{"encolink-101", "request that resets channels 2 and 3", vendor, "", "aa00", "", "config=0xAA ra=0"},
    VectorText{"encolink-102", "request before the identity", vendor, "", "bb00", "", "config=0xBB ra=0"},
    VectorText{"encolink-103", "error bit low", derived, single20, ask, "003e817c00",
               "singleturn=1000 error=1 warning=0 channel2=0"},
    VectorText{"encolink-104", "padding set: the encoder has 21 bits", derived, single20, ask, "003e8b9800",
               "out_of_range"},
    VectorText{"encolink-105", "MT res 22 without padding", derived, "resolution=22 multiturn_bits=16", ask,
               "000712aa97055a", "singleturn=305829 multiturn=7 error=0 warning=0 channel2=0x5A"},
    VectorText{"encolink-106", "MT with 12 bits of turns", derived, "resolution=20 multiturn_bits=12", ask,
               "1230003e83a300", "singleturn=1000 multiturn=0x123 error=0 warning=0 channel2=0"},
    VectorText{"encolink-107", "MT with 12 bits: padding of the turns set", derived, "resolution=20 multiturn_bits=12",
               ask, "1234003e83d000", "out_of_range"},
    VectorText{"encolink-108", "without channel 2", derived, "resolution=20 multiturn_bits=0 has_ch2=false", ask,
               "003e83c5", "singleturn=1000 error=0 warning=0"},
    VectorText{"encolink-109", "one byte more", derived, single20, ask, "003e83c50000", "wrong_length"},
    VectorText{"encolink-110", "identity, single-turn, protocol version 4", derived, "", "",
               "04054d42303830534c4132304d454e54303088",
               "protocol_version=4 frame_bytes=5 resolution=20 part_number=MB080SLA20MENT00"},
    VectorText{"encolink-111", "identity, multi-turn", derived, "", "", "02074d42303830534c4132304d454e54303029",
               "protocol_version=2 frame_bytes=7 resolution=20 part_number=MB080SLA20MENT00"},
    VectorText{"encolink-112", "identity of an unknown protocol version", derived, "", "",
               "03054d42303830534c4132304d454e543030d5", "unexpected_reply"},
    VectorText{"encolink-113", "identity with a resolution of 29 bits", derived, "", "",
               "02054d42303830534c4132394d454e543030a5", "out_of_range"},
    VectorText{"encolink-114", "channel 3 byte stream: write 4 bytes at 0 (position offset)", derived, "",
               "00cdef89ab58000400000000123456787b", "",
               "op=write address=0 length=4 data=\x12\x34\x56\x78 value=0x12345678"},
    VectorText{"encolink-115", "channel 3 byte stream with a wrong CRC", derived, "", "00cdef89ab5900020000004c06", "",
               "bad_checksum"},
};

// SPI carries the same frames as the UART, so three test vectors are enough for SPI.
inline constexpr std::array spi{
    VectorText{"encolink-spi-001", "ST res 19 pos 275096", derived, "resolution=19 multiturn_bits=0", ask, "8653036200",
               "singleturn=275096 error=0 warning=0 channel2=0"},
    VectorText{"encolink-spi-002", "MT with 12 bits of turns", derived, "resolution=20 multiturn_bits=12", ask,
               "1230003e83a300", "singleturn=1000 multiturn=0x123 error=0 warning=0 channel2=0"},
    VectorText{"encolink-spi-003", "channel 2 ST cycle", derived, "resolution=19 multiturn_bits=0", "",
               "2468a3000033d3", "singleturn=74565 error=0 warning=0 status=0 alarms=0 channel3=0x33"},
};

}  // namespace vector_texts

}  // namespace absenc::encolink
