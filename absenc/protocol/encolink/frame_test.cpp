// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/frame.hpp"

#include <gtest/gtest.h>

#include <array>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/encolink/channels.hpp"
#include "absenc/protocol/encolink/fields.hpp"
#include "absenc/protocol/encolink/options.hpp"
#include "absenc/protocol/encolink/registers.hpp"
#include "absenc/protocol/encolink/unit.hpp"

namespace absenc::encolink {
namespace {

constexpr Format single{.resolution = 19, .multiturn_bits = 0};
constexpr Format multi{.resolution = 19, .multiturn_bits = 16};

static_assert(checksum(std::array<std::uint8_t, 9>{'1', '2', '3', '4', '5', '6', '7', '8', '9'}) == 0x6B);

// "Inverted CRC": of 00 00 00 it is FF, so that neither a low nor a high wire passes.
TEST(EncolinkFrame, WiresThatAreStuckDoNotPass) {
  EXPECT_EQ(decode_position(single, hex<"0000000000">).error(), Error::bad_checksum);
  EXPECT_EQ(decode_position(single, hex<"FFFFFFFFFF">).error(), Error::bad_checksum);
  EXPECT_TRUE(decode_position(single, hex<"000000FF00">).has_value());
}

TEST(EncolinkFrame, ErrorAndWarningAreActiveLow) {
  const Position bad{.singleturn = 1000, .error = true};
  const Result<Position> error = decode_position(single, encode_position(single, bad));
  EXPECT_TRUE(error->error);
  EXPECT_FALSE(error->warning);
  EXPECT_EQ(to_reading(single, *error).singleturn_valid_bits, 0u);
  EXPECT_EQ(to_reading(single, *error).status, general::error);

  const Position near{.singleturn = 1000, .warning = true};
  const Result<Position> warning = decode_position(single, encode_position(single, near));
  EXPECT_TRUE(warning->warning);
  EXPECT_TRUE(to_reading(single, *warning).singleturn_valid());
  EXPECT_EQ(to_reading(single, *warning).status, general::warning);
}

TEST(EncolinkFrame, TheChannel2ByteIsOutsideTheChecksum) {
  ReplyBytes frame = encode_position(multi, {.singleturn = 5, .multiturn = 6});
  for (unsigned byte = 0; byte < 256; ++byte) {
    frame[6] = static_cast<std::uint8_t>(byte);
    ASSERT_EQ(decode_position(multi, frame)->channel2, byte);
  }
}

TEST(EncolinkFrame, EveryErrorOfUpToThreeBitsIsSeen) {
  const ReplyBytes good = encode_position({.resolution = 22, .multiturn_bits = 16}, {0x2AAAAA, 0x1234});
  constexpr unsigned covered_bits = 48;
  const auto flip = [](ReplyBytes& frame, unsigned bit) { frame[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8); };
  for (unsigned a = 0; a < covered_bits; ++a) {
    for (unsigned b = a; b < covered_bits; ++b) {
      for (unsigned c = b; c < covered_bits; ++c) {
        ReplyBytes bad = good;
        flip(bad, a);
        if (b != a) flip(bad, b);
        if (c != b) flip(bad, c);
        ASSERT_FALSE(decode_position({.resolution = 22, .multiturn_bits = 16}, bad).has_value());
      }
    }
  }
}

TEST(EncolinkFrame, AHigherResolutionThanSetIsOutOfRange) {
  const ReplyBytes fine = encode_position({.resolution = 20, .multiturn_bits = 0}, {.singleturn = 1});
  EXPECT_EQ(decode_position(single, fine).error(), Error::out_of_range);
  const ReplyBytes turns = encode_position({.resolution = 19, .multiturn_bits = 16}, {.multiturn = 1});
  EXPECT_EQ(decode_position({.resolution = 19, .multiturn_bits = 12}, turns).error(), Error::out_of_range);
}

TEST(EncolinkFrame, LengthsAreThoseOfTurnsAndChannel2) {
  EXPECT_EQ(single.frame_bytes(), 5u);
  EXPECT_EQ(multi.frame_bytes(), 7u);
  EXPECT_EQ(single.cycle_bytes(), 7u);
  EXPECT_EQ(multi.cycle_bytes(), 9u);
  EXPECT_EQ((Format{19, 0, false}.frame_bytes()), 4u);
  EXPECT_EQ((Format{19, 16, false}.frame_bytes()), 6u);
}

TEST(EncolinkFrame, AByteBehindTheIdentityMeansNothing) {
  ReplyBytes bytes = encode_identity({.frame_bytes = 7, .resolution = 18});
  for (const std::uint8_t behind : std::initializer_list<std::uint8_t>{0x00, 0x5A, 0xFF}) {
    ReplyBytes padded = bytes;
    padded.push_back(behind);
    ASSERT_TRUE(decode_identity(padded).has_value());
    EXPECT_EQ(decode_identity(padded)->resolution, 18u);
    padded[18] = static_cast<std::uint8_t>(padded[18] ^ 1);
    EXPECT_EQ(decode_identity(padded).error(), Error::bad_checksum);
  }
  bytes.clear();
  EXPECT_EQ(decode_identity(bytes).error(), Error::wrong_length);
}

TEST(EncolinkFrame, TheIdentityCompletesTheFormat) {
  const Identity turns{.frame_bytes = 7, .resolution = 18};
  const Result<Format> asked = complete({}, turns);
  EXPECT_EQ(asked->resolution, 18u);
  EXPECT_EQ(asked->multiturn_bits, 16);
  EXPECT_EQ(complete({.multiturn_bits = 12}, turns)->multiturn_bits, 12);
  EXPECT_EQ(complete({.resolution = 18}, turns)->resolution, 18u);
  EXPECT_EQ(complete({.resolution = 17}, turns).error(), Error::unexpected_reply);
  EXPECT_EQ(as_identified({.resolution = 17, .multiturn_bits = 12}, turns).resolution, 18u);
  EXPECT_EQ(as_identified({.resolution = 17, .multiturn_bits = 12}, turns).multiturn_bits, 12);
  EXPECT_EQ(as_identified({.multiturn_bits = 0}, turns).multiturn_bits, 16);
  EXPECT_EQ(complete({.multiturn_bits = 0}, turns).error(), Error::unexpected_reply);
  EXPECT_EQ(complete({}, {.frame_bytes = 5, .resolution = 18})->multiturn_bits, 0);
}

TEST(EncolinkFrame, AMismatchOfTheTurnsLeavesTheAngle) {
  Reading reading = to_reading(multi, {.singleturn = 5, .multiturn = 6});
  EXPECT_TRUE(reading.multiturn_valid);
  add_status(reading, status::multiturn_mismatch);
  EXPECT_FALSE(reading.multiturn_valid);
  EXPECT_TRUE(reading.singleturn_valid());
  add_status(reading, status::position_invalid);
  EXPECT_FALSE(reading.singleturn_valid());
}

TEST(EncolinkFrame, EveryAlarmHasItsWords) {
  for (const FlagInfo& flag : alarm_flags) {
    EXPECT_FALSE(flag.name.empty() || flag.meaning.empty() || flag.action.empty()) << flag.name;
  }
}

// ---- Registers

TEST(EncolinkRegisters, AccessesAreWhatTheVendorSends) {
  EXPECT_EQ(encode_access(read_request(0x4C, 2)).view().size(), 13u);
  const AccessBytes save = encode_access(write_request(0x49, 1, commands::save));
  const auto wanted = hex<"00CDEF89AB580001000000496342">;
  EXPECT_TRUE(std::equal(save.view().begin(), save.view().end(), wanted.begin(), wanted.end()));
}

TEST(EncolinkRegisters, BadAccessesAreNamed) {
  EXPECT_EQ(decode_access({}).error(), Error::wrong_length);
  EXPECT_EQ(decode_access(hex<"00CDEF">).error(), Error::wrong_length);
  EXPECT_EQ(decode_access(hex<"00CDEF89AC5900020000004C05">).error(), Error::bad_framing);
  EXPECT_EQ(decode_access(hex<"00CDEF89AB5A00020000004C05">).error(), Error::unsupported);
  EXPECT_EQ(decode_access(hex<"00CDEF89AB5900020000004C0500">).error(), Error::wrong_length);
  EXPECT_EQ(decode_access(hex<"00CDEF89AB58000200000049634200">).error(), Error::bad_checksum);
  EXPECT_EQ(decode_access(hex<"00CDEF89AB5900020000004C04">).error(), Error::bad_checksum);
}

TEST(EncolinkRegisters, TheTableAgreesWithTheFields) {
  for (std::size_t i = 0; i < registers.size(); ++i) {
    EXPECT_EQ(register_fields[i].name, registers[i].name);
    EXPECT_EQ(find_register(registers[i].address), &registers[i]);
    EXPECT_LE(registers[i].size, access_capacity);
  }
}

// ---- Channels

TEST(EncolinkChannels, ACycleIsComparedWithTheFrameInWhichItBegan) {
  const Position place{.singleturn = 74565, .multiturn = 7};
  const ReplyBytes bytes = encode_cycle(multi, {place, 0x10, channel3::idle});
  const auto run = [&](Position first, Position others) {
    CycleReader reader;
    reader.restart();
    std::optional<Result<Cycle>> last;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      Position frame = i == 0 ? first : others;
      frame.channel2 = bytes[i];
      last = reader.feed(multi, frame);
      EXPECT_EQ(last.has_value(), i == bytes.size() - 1);
    }
    return *last;
  };
  EXPECT_EQ(run(place, {.singleturn = 1})->status, 0x10);
  EXPECT_EQ(run({.singleturn = 74566, .multiturn = 7}, place).error(), Error::cross_check_failed);
  EXPECT_EQ(run({.singleturn = 74565, .multiturn = 8}, place).error(), Error::cross_check_failed);
}

TEST(EncolinkChannels, ADamagedCycleLosesTheStep) {
  CycleReader reader;
  Position frame{};
  EXPECT_FALSE(reader.feed(single, frame).has_value());  // not in step: nothing is made of it
  reader.restart();
  for (unsigned i = 0; i < 6; ++i) EXPECT_FALSE(reader.feed(single, frame).has_value());
  EXPECT_EQ(reader.feed(single, frame)->error(), Error::bad_checksum);  // seven zeros
  EXPECT_FALSE(reader.in_step());
}

TEST(EncolinkChannels, AnAccessGoesThroughBusyToItsData) {
  RegisterAccess access;
  access.start(read_request(0x4C, 2));
  for (unsigned i = 0; i < 13; ++i) {
    EXPECT_EQ(access.state(), RegisterAccess::State::asking);
    access.next_byte(Time{1});
  }
  EXPECT_EQ(access.next_byte(Time{2}), 0);
  for (const std::uint8_t byte : hex<"336666880901">) access.feed(byte);
  EXPECT_EQ(access.state(), RegisterAccess::State::data);
  access.feed(0x5E);
  EXPECT_EQ(access.state(), RegisterAccess::State::done);
  EXPECT_EQ(load_big_endian(access.data()), 0x15Eu);

  access.restart();
  while (access.state() == RegisterAccess::State::asking) access.next_byte(Time{1});
  access.feed(channel3::write_ready);  // it was no write
  EXPECT_EQ(access.state(), RegisterAccess::State::nonsense);
}

// ---- Descriptor

TEST(EncolinkUnit, AFrameEndsWhereItsChecksumSays) {
  Options values;
  values.values[options.find("multiturn_bits")] = 0;
  values.values[options.find("has_ch2")] = 1;
  const Delimit broken = unit.delimit(values, Direction::reply, hex<"00000000000000000000000000000000000000">);
  EXPECT_EQ(broken.kind, Delimit::Kind::no_frame);
  EXPECT_EQ(unit.delimit(values, Direction::request, hex<"AA00">).size, 2u);
  EXPECT_EQ(unit.delimit(values, Direction::request, hex<"A900">).kind, Delimit::Kind::no_frame);
}

TEST(EncolinkUnit, EncodesTheBytesThatDoTheWork) {
  std::array<std::uint8_t, 64> bytes{};
  const auto encoded = [&](std::string_view name, std::vector<std::int64_t> arguments = {}) {
    const Result<std::size_t> size = unit.encode({}, *find_command(unit, name), arguments, bytes);
    return size ? std::vector<std::uint8_t>(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(*size))
                : std::vector<std::uint8_t>{};
  };
  const auto bytes_of = [](Bytes wanted) { return std::vector<std::uint8_t>(wanted.begin(), wanted.end()); };
  EXPECT_EQ(encoded("position"), bytes_of(hex<"0000">));
  EXPECT_EQ(encoded("alarms"), bytes_of(hex<"AA00">));
  EXPECT_EQ(encoded("identify"), bytes_of(hex<"BB00">));
  EXPECT_EQ(encoded("temperature"), bytes_of(hex<"00CDEF89AB5900020000004C05">));
  EXPECT_EQ(encoded("save"), bytes_of(hex<"00CDEF89AB580001000000496342">));
  EXPECT_EQ(encoded("memory-write", {0, 0x12345678, 0}), bytes_of(hex<"00CDEF89AB58000400000000123456787B">));
  EXPECT_EQ(encoded("memory-read", {0x1234, 0}), bytes_of({}));  // how many bytes?
  EXPECT_EQ(encoded("memory-write", {0x49, 0x63, 9}), bytes_of({}));
}

}  // namespace
}  // namespace absenc::encolink
