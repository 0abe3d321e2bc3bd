// SPDX-License-Identifier: Apache-2.0
// Tests of frames, identities and register accesses, in addition to the test vectors.
#include "absenc/protocol/encolink/frame.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/encolink/fields.hpp"
#include "absenc/protocol/encolink/unit.hpp"

namespace absenc::encolink {
namespace {

constexpr Format single{.resolution = 19, .multiturn_bits = 0};
constexpr Format multi{.resolution = 19, .multiturn_bits = 16};

static_assert(checksum(std::array<std::uint8_t, 9>{'1', '2', '3', '4', '5', '6', '7', '8', '9'}) == 0x6B);

TEST(EncolinkFrame, DetectsEveryErrorOfUpToThreeBits) {
  constexpr Format format{.resolution = 22, .multiturn_bits = 16};
  const ReplyBytes good = encode_position(format, {0x2AAAAA, 0x1234});
  constexpr unsigned covered_bits = 48;
  const auto flip = [](ReplyBytes& frame, unsigned bit) { frame[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8); };
  for (unsigned a = 0; a < covered_bits; ++a) {
    for (unsigned b = a; b < covered_bits; ++b) {
      for (unsigned c = b; c < covered_bits; ++c) {
        ReplyBytes bad = good;
        flip(bad, a);
        if (b != a) flip(bad, b);
        if (c != b) flip(bad, c);
        ASSERT_FALSE(decode_position(format, bad).has_value());
      }
    }
  }
}

TEST(EncolinkFrame, ReadingValidityFollowsStatus) {
  struct Case {
    Position position;
    std::uint16_t detailed;
    bool angle;
    bool turns;
    std::uint32_t status;
  };
  for (const Case& one : std::vector<Case>{{{}, 0, true, true, 0},
                                           {{.error = true}, 0, false, false, general::error},
                                           {{.warning = true}, status::temperature, true, true, general::warning},
                                           {{}, status::multiturn_mismatch, true, false, 0},
                                           {{}, status::position_invalid, false, true, 0}}) {
    const Result<Position> position = decode_position(multi, encode_position(multi, one.position));
    const Reading reading = to_reading(multi, *position, one.detailed);
    EXPECT_EQ(reading.singleturn_valid(), one.angle);
    EXPECT_EQ(reading.multiturn_valid, one.turns);
    EXPECT_EQ(reading.status, one.status);
    EXPECT_EQ(reading.alarms, one.detailed);
  }
  EXPECT_FALSE(to_reading(single, {}).multiturn_valid);
}

// A position frame shows that no error is raised if its error bit is clear, and that no warning is if its warning bit
// is clear; a set bit shows no single alarm.
TEST(EncolinkFrame, StatusBitsReportOnlyClearAlarms) {
  EXPECT_EQ(to_reading(multi, {}).status_reported, general::error | general::warning);
  EXPECT_EQ(to_reading(multi, {}).alarms_reported, 0xFFFFu);
  EXPECT_EQ(to_reading(multi, {.error = true}).alarms_reported, status::warnings);
  EXPECT_EQ(to_reading(multi, {.warning = true}).alarms_reported, status::errors);
  EXPECT_EQ(to_reading(multi, {.error = true}, status::system).alarms_reported, 0xFFFFu);
  Format alone = multi;
  alone.has_ch2 = false;
  EXPECT_EQ(to_reading(alone, {}).alarms_reported, 0u);
  EXPECT_EQ(to_reading(alone, {}).status_reported, general::error | general::warning);
}

// The two status bits of a later position frame only show if there is an error or a warning, not which.
TEST(EncolinkFrame, RemembersAlarmsOfCycleWhileStatusBitsAgree) {
  constexpr Position bad{.singleturn = 5, .error = true};
  constexpr Position warned{.singleturn = 5, .warning = true};
  const Reading lost = to_reading(multi, bad, status::signal_lost);
  const Reading hot = to_reading(multi, warned, status::temperature);
  EXPECT_EQ(remembered(lost, to_reading(multi, bad)).alarms, status::signal_lost);
  EXPECT_EQ(remembered(lost, to_reading(multi, bad)).alarms_reported, 0xFFFFu);
  EXPECT_EQ(remembered(hot, to_reading(multi, warned)).alarms, status::temperature);
  EXPECT_EQ(remembered(hot, to_reading(multi, warned)).alarms_reported, 0xFFFFu);
  // The frame `bad` sets the error bit, which was clear before: it is unknown which error was raised.
  EXPECT_EQ(remembered(hot, to_reading(multi, bad)).alarms, 0u);
  EXPECT_EQ(remembered(hot, to_reading(multi, bad)).alarms_reported, status::warnings);
  EXPECT_EQ(remembered(lost, to_reading(multi, {.singleturn = 5})).alarms, 0u);
  EXPECT_EQ(remembered(lost, to_reading(multi, {.singleturn = 5})).alarms_reported, 0xFFFFu);
}

TEST(EncolinkFrame, IgnoresByteAfterIdentity) {
  ReplyBytes padded = encode_identity({.frame_bytes = 7, .resolution = 18});
  padded.push_back(0x5A);
  ASSERT_TRUE(decode_identity(padded).has_value());
  EXPECT_EQ(decode_identity(padded)->resolution, 18u);
  padded[18] = static_cast<std::uint8_t>(padded[18] ^ 1);
  EXPECT_EQ(decode_identity(padded).error(), Error::bad_checksum);
  EXPECT_EQ(decode_identity({}).error(), Error::wrong_length);
}

TEST(EncolinkFrame, RejectsIdentityOfUnknownVersionOrLength) {
  for (const Identity& other : {Identity{.protocol_version = 3}, Identity{.frame_bytes = 6}}) {
    EXPECT_EQ(decode_identity(encode_identity(other)).error(), Error::unexpected_reply);
  }
}

TEST(EncolinkFrame, RejectsIdentityWithInvalidResolution) {
  for (const unsigned bits : {0u, 23u}) {
    EXPECT_EQ(decode_identity(encode_identity({.resolution = bits})).error(), Error::out_of_range);
  }
  ReplyBytes strange = encode_identity({.resolution = 10});
  strange[11] = '0' - 1;
  strange[18] = checksum(strange.view().first(18));
  EXPECT_EQ(decode_identity(strange).error(), Error::out_of_range);
}

TEST(EncolinkFrame, RejectsCycleOfWrongLength) {
  const ReplyBytes cycle = encode_cycle(single, {{.singleturn = 5}, 0, channel3::idle});
  ASSERT_TRUE(decode_cycle(single, cycle).has_value());
  EXPECT_EQ(decode_cycle(single, cycle.view().first(cycle.size() - 1)).error(), Error::wrong_length);
  EXPECT_EQ(decode_cycle(single, {}).error(), Error::wrong_length);
}

TEST(EncolinkFrame, CompletesFormatFromIdentity) {
  const Identity turns{.frame_bytes = 7, .resolution = 18};
  const Result<Format> asked = complete({}, turns);
  EXPECT_EQ(asked->resolution, 18u);
  EXPECT_EQ(asked->multiturn_bits, 16);
  EXPECT_EQ(complete({.multiturn_bits = 12}, turns)->multiturn_bits, 12);
  EXPECT_EQ(complete({.resolution = 18}, turns)->resolution, 18u);
  EXPECT_EQ(complete({.resolution = 17}, turns).error(), Error::unexpected_reply);
  EXPECT_EQ(complete({.multiturn_bits = 0}, turns).error(), Error::unexpected_reply);
  EXPECT_EQ(complete({}, {.frame_bytes = 5, .resolution = 18})->multiturn_bits, 0);
  const Format known = as_identified({.resolution = 17, .multiturn_bits = 12}, turns);
  EXPECT_EQ(known.resolution, 18u);
  EXPECT_EQ(known.multiturn_bits, 12);
  EXPECT_EQ(as_identified({.multiturn_bits = 0}, turns).multiturn_bits, 16);
}

TEST(EncolinkFrame, DistinguishesErrorsOfAccesses) {
  EXPECT_EQ(decode_access({}).error(), Error::wrong_length);
  EXPECT_EQ(decode_access(hex<"00CDEF">).error(), Error::wrong_length);
  EXPECT_EQ(decode_access(hex<"00CDEF89AB59000200">).error(), Error::wrong_length);
  EXPECT_EQ(decode_access(hex<"00CDEF89AC5900020000004C05">).error(), Error::bad_framing);
  EXPECT_EQ(decode_access(hex<"00CDEF89AB5A00020000004C05">).error(), Error::unsupported);
  EXPECT_EQ(decode_access(hex<"00CDEF89AB5900020000004C0500">).error(), Error::wrong_length);
  EXPECT_EQ(decode_access(hex<"00CDEF89AB58000200000049634200">).error(), Error::bad_checksum);
  EXPECT_EQ(decode_access(hex<"00CDEF89AB5900020000004C04">).error(), Error::bad_checksum);
}

TEST(EncolinkUnit, FindsFrameEndByChecksum) {
  const Options values = author::testing::options_of(unit, "multiturn_bits=0");
  const FrameEnd broken = unit.frame_end(values, Direction::reply, hex<"00000000000000000000000000000000000000">);
  EXPECT_EQ(broken.kind, FrameEnd::Kind::no_frame);
  EXPECT_EQ(unit.frame_end(values, Direction::request, hex<"AA00">).size, 2u);
  EXPECT_EQ(unit.frame_end(values, Direction::request, hex<"A900">).kind, FrameEnd::Kind::no_frame);
}

TEST(EncolinkUnit, EncodesRequestOfEachCommand) {
  struct Case {
    std::string_view command;
    std::vector<std::int64_t> arguments;
    std::vector<std::uint8_t> bytes;
  };
  const auto of = [](Bytes bytes) { return std::vector<std::uint8_t>(bytes.begin(), bytes.end()); };
  for (const Case& one :
       std::vector<Case>{{"position", {}, of(hex<"0000">)},
                         {"alarms", {}, of(hex<"AA00">)},
                         {"identify", {}, of(hex<"BB00">)},
                         {"temperature", {}, of(hex<"00CDEF89AB5900020000004C05">)},
                         {"save", {}, of(hex<"00CDEF89AB580001000000496342">)},
                         {"memory-write", {0, 0x12345678, 0}, of(hex<"00CDEF89AB58000400000000123456787B">)},
                         // the table has no register at 0x1234, so the number of bytes is unknown
                         {"memory-read", {0x1234, 0}, {}},
                         {"memory-write", {0x1234, 0, 0}, {}},
                         {"memory-write", {0x64, 1, 0}, {}},  // the register at 0x64 has 20 bytes, which is no number
                         {"memory-write", {0x49, 0x63, 9}, {}}}) {
    std::array<std::uint8_t, 64> bytes{};
    const Result<std::size_t> size = unit.encode({}, *find_command(unit, one.command), one.arguments, bytes);
    EXPECT_EQ(of(Bytes(bytes).first(size.value_or(0))), one.bytes) << one.command;
  }
}

}  // namespace
}  // namespace absenc::encolink
