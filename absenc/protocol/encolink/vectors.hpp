// SPDX-License-Identifier: Apache-2.0
// EncoLink frames with their source. The unit decodes each at compile time: a broken frame does not build.
#pragma once

#include <array>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

namespace expected {
inline constexpr std::array<Expected, 4> v001{{{"singleturn", 0}, {"error", 0}, {"warning", 0}, {"channel2", 0}}};
inline constexpr std::array<Expected, 4> v002{{{"singleturn", 131071}, {"error", 0}, {"warning", 0}, {"channel2", 0}}};
inline constexpr std::array<Expected, 4> v004{{{"singleturn", 275096}, {"error", 0}, {"warning", 0}, {"channel2", 0}}};
inline constexpr std::array<Expected, 4> v006{{{"singleturn", 4194303}, {"error", 0}, {"warning", 0}, {"channel2", 0}}};
inline constexpr std::array<Expected, 4> v009{{{"singleturn", 1000}, {"error", 0}, {"warning", 1}, {"channel2", 0}}};
inline constexpr std::array<Expected, 6> v017{
    {{"singleturn", 74565}, {"error", 0}, {"warning", 0}, {"status", 0}, {"alarms", 0}, {"channel3", 0x33}}};
inline constexpr std::array<Expected, 7> v018{{{"singleturn", 74565},
                                               {"multiturn", 7},
                                               {"error", 0},
                                               {"warning", 0},
                                               {"status", 16},
                                               {"alarms", 16},
                                               {"channel3", 0x33}}};
inline constexpr std::array<Expected, 3> v019{{{"op", 0, 0, "read"}, {"address", 76}, {"length", 2}}};
inline constexpr std::array<Expected, 4> v021{
    {{"op", 0, 0, "write"}, {"address", 73}, {"length", 1}, {"data", 0, 0, "\x63"}}};
inline constexpr std::array<Expected, 2> v101{{{"config", 0xAA}, {"ra", 0}}};
inline constexpr std::array<Expected, 2> v102{{{"config", 0xBB}, {"ra", 0}}};
inline constexpr std::array<Expected, 4> v103{{{"singleturn", 1000}, {"error", 1}, {"warning", 0}, {"channel2", 0}}};
inline constexpr std::array<Expected, 5> v105{
    {{"singleturn", 305829}, {"multiturn", 7}, {"error", 0}, {"warning", 0}, {"channel2", 0x5A}}};
inline constexpr std::array<Expected, 5> v106{
    {{"singleturn", 1000}, {"multiturn", 0x123}, {"error", 0}, {"warning", 0}, {"channel2", 0}}};
inline constexpr std::array<Expected, 3> v108{{{"singleturn", 1000}, {"error", 0}, {"warning", 0}}};
inline constexpr std::array<Expected, 4> v110{
    {{"protocol_version", 4}, {"frame_bytes", 5}, {"resolution", 20}, {"part_number", 0, 0, "MB080SLA20MENT00"}}};
inline constexpr std::array<Expected, 4> v111{
    {{"protocol_version", 2}, {"frame_bytes", 7}, {"resolution", 20}, {"part_number", 0, 0, "MB080SLA20MENT00"}}};
inline constexpr std::array<Expected, 4> v114{
    {{"op", 0, 0, "write"}, {"address", 0}, {"length", 4}, {"data", 0, 0, "\x12\x34\x56\x78"}}};
}  // namespace expected

// clang-format off
inline constexpr std::array<Vector, 28> vectors{{
    {"encolink-001", "ST res 17 pos 0", "derived", "resolution=17 multiturn_bits=0", hex<"0000">, hex<"000003d100">, expected::v001},
    {"encolink-002", "ST res 17 pos 131071", "derived", "resolution=17 multiturn_bits=0", hex<"0000">, hex<"ffff831500">, expected::v002},
    {"encolink-004", "ST res 19 pos 275096", "derived", "resolution=19 multiturn_bits=0", hex<"0000">, hex<"8653036200">, expected::v004},
    {"encolink-006", "ST res 22 pos 4194303", "derived", "resolution=22 multiturn_bits=0", hex<"0000">, hex<"ffffffa500">, expected::v006},
    {"encolink-009", "warning bit low", "derived", "resolution=20 multiturn_bits=0", hex<"0000">, hex<"003e825200">, expected::v009},
    {"encolink-012", "CRC not inverted", "derived", "resolution=20 multiturn_bits=0", hex<"0000">, hex<"003e833a00">, {}, Error::bad_checksum},
    {"encolink-014", "short frame", "derived", "resolution=20 multiturn_bits=0", hex<"0000">, hex<"003e83c5">, {}, Error::wrong_length},
    {"encolink-015", "all zero reply (MISO low): CRC of 00 00 00 is FF", "derived", "resolution=20 multiturn_bits=0", hex<"0000">, hex<"0000000000">, {}, Error::bad_checksum},
    {"encolink-016", "all FF reply (MISO high)", "derived", "resolution=20 multiturn_bits=0", hex<"0000">, hex<"ffffffffff">, {}, Error::bad_checksum},
    {"encolink-017", "channel 2 ST 7-byte cycle, status 0x0000, ch3 idle 0x33", "derived", "resolution=19 multiturn_bits=0", hex<"">, hex<"2468a3000033d3">, expected::v017},
    {"encolink-018", "channel 2 MT 9-byte cycle, status 0x0010 temperature", "derived", "resolution=19 multiturn_bits=16", hex<"">, hex<"00072468a3001033e9">, expected::v018},
    {"encolink-019", "channel 3 byte stream: read 2 bytes at 0x4C (temperature)", "derived", "", hex<"00cdef89ab5900020000004c05">, hex<"">, expected::v019},
    {"encolink-021", "channel 3 byte stream: write 0x63 (save) to 0x49", "derived", "", hex<"00cdef89ab580001000000496342">, hex<"">, expected::v021},
    {"encolink-101", "request that resets channels 2 and 3", "rls-encolink 1.0.1", "", hex<"aa00">, hex<"">, expected::v101},
    {"encolink-102", "request before the identity", "rls-encolink 1.0.1", "", hex<"bb00">, hex<"">, expected::v102},
    {"encolink-103", "error bit low", "derived", "resolution=20 multiturn_bits=0", hex<"0000">, hex<"003e817c00">, expected::v103},
    {"encolink-104", "padding set: the encoder has 21 bits", "derived", "resolution=20 multiturn_bits=0", hex<"0000">, hex<"003e8b9800">, {}, Error::out_of_range},
    {"encolink-105", "MT res 22 without padding", "derived", "resolution=22 multiturn_bits=16", hex<"0000">, hex<"000712aa97055a">, expected::v105},
    {"encolink-106", "MT with 12 bits of turns", "derived", "resolution=20 multiturn_bits=12", hex<"0000">, hex<"1230003e83a300">, expected::v106},
    {"encolink-107", "MT with 12 bits: padding of the turns set", "derived", "resolution=20 multiturn_bits=12", hex<"0000">, hex<"1234003e83d000">, {}, Error::out_of_range},
    {"encolink-108", "without channel 2", "derived", "resolution=20 multiturn_bits=0 has_ch2=false", hex<"0000">, hex<"003e83c5">, expected::v108},
    {"encolink-109", "one byte more", "derived", "resolution=20 multiturn_bits=0", hex<"0000">, hex<"003e83c50000">, {}, Error::wrong_length},
    {"encolink-110", "identity, single-turn, protocol version 4", "derived", "", hex<"">, hex<"04054d42303830534c4132304d454e54303088">, expected::v110},
    {"encolink-111", "identity, multi-turn", "derived", "", hex<"">, hex<"02074d42303830534c4132304d454e54303029">, expected::v111},
    {"encolink-112", "identity of an unknown protocol version", "derived", "", hex<"">, hex<"03054d42303830534c4132304d454e543030d5">, {}, Error::unexpected_reply},
    {"encolink-113", "identity with a resolution of 29 bits", "derived", "", hex<"">, hex<"02054d42303830534c4132394d454e543030a5">, {}, Error::out_of_range},
    {"encolink-114", "channel 3 byte stream: write 4 bytes at 0 (position offset)", "derived", "", hex<"00cdef89ab58000400000000123456787b">, hex<"">, expected::v114},
    {"encolink-115", "channel 3 byte stream with a wrong CRC", "derived", "", hex<"00cdef89ab5900020000004c06">, hex<"">, {}, Error::bad_checksum},
}};

// The same frames go over SPI: one of each length, and what a broken wire gives.
inline constexpr std::array<Vector, 3> spi_vectors{{
    {"encolink-spi-001", "ST res 19 pos 275096", "derived", "resolution=19 multiturn_bits=0", hex<"0000">, hex<"8653036200">, expected::v004},
    {"encolink-spi-002", "MT with 12 bits of turns", "derived", "resolution=20 multiturn_bits=12", hex<"0000">, hex<"1230003e83a300">, expected::v106},
    {"encolink-spi-003", "channel 2 ST cycle", "derived", "resolution=19 multiturn_bits=0", hex<"">, hex<"2468a3000033d3">, expected::v017},
}};
// clang-format on

}  // namespace absenc::encolink
