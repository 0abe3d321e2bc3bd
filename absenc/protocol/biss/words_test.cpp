// SPDX-License-Identifier: Apache-2.0
// Tests of BiSS frames with one or several words.
#include <gtest/gtest.h>

#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/biss/commands.hpp"
#include "absenc/protocol/biss/unit.hpp"

namespace absenc::biss {
namespace {

template <class F>
void expect_unusable(const F& format) {
  EXPECT_FALSE(is_usable(format));
  BitBuffer<512> frame;
  EXPECT_TRUE(encode(F{}, {}, frame));
  EXPECT_EQ(detail::decoded(format, frame.view()).error(), Error::invalid_argument);
}

TEST(BissWords, ChainNeedsOneToEightWordsWithPosition) {
  ChainFormat format;
  format.count = ChainFormat::most;
  format.slave = ChainFormat::most - 1;
  EXPECT_TRUE(is_usable(format));
  format.count = ChainFormat::most + 1;
  expect_unusable(format);
  format.count = format.slave;  // no slave has the number `format.slave`
  expect_unusable(format);
  format = {};
  format.channels[1].word = WordFormat{};
  expect_unusable(format);
  format = {};
  format.channels[1].check.poly = 0x02;
  expect_unusable(format);
}

TEST(BissWords, SafetyNeedsValidCheckInBothWords) {
  SafetyFormat format;
  EXPECT_TRUE(is_usable(format));
  format.cpw.check.poly = 0x02;
  expect_unusable(format);
  format = {};
  format.spw.check.poly = 0x02;
  expect_unusable(format);
}

// With an even polynomial the last bit of the CRC never changes.
TEST(BissWords, RejectsEvenPolynomial) {
  Options options;
  const std::array<OptionText, 2> even{{{"crc_width", "6"}, {"crc_poly", "2"}}};
  ASSERT_EQ(resolve_options(unit, {}, even, options).kind, OptionError::Kind::none);
  NoFields fields;
  BitBuffer<512> frame;
  EXPECT_TRUE(encode(Format{.check = {.poly = 2}}, {}, frame));
  EXPECT_EQ(unit.decode(options, {}, {.bytes = frame.bytes(), .bits = frame.size()}, fields), Error::invalid_argument);
}

template <class F>
void expect_no_room() {
  BitBuffer<512> frame;
  ASSERT_TRUE(encode(F{}, {}, frame));
  BitBuffer<24> small;
  EXPECT_FALSE(encode(F{}, {}, small));
  EXPECT_EQ(small.size(), 0u);
}

TEST(BissWords, EncodeFailsWithoutRoom) {
  expect_no_room<Format>();
  expect_no_room<ChainFormat>();
  expect_no_room<SafetyFormat>();
}

TEST(BissWords, SafetyComparesPositionsAndLifeCounter) {
  SafetyFormat format;
  const auto error = [&format](std::uint64_t control, std::uint64_t safety, std::uint8_t life_counter) {
    SafetyReply reply;
    reply.cpw.word.position = control;
    reply.spw = {.word = {.position = safety}, .life_counter = life_counter};
    BitBuffer<512> frame;
    EXPECT_TRUE(encode(format, reply, frame));
    return decode(format, frame.view()).error();
  };
  // The decoder compares the highest 13 bits of both positions; the position has 24 bits in the CPW and 16 bits in the
  // SPW.
  EXPECT_EQ(error(0x123456, 0x1234, 5), Error::none);
  EXPECT_EQ(error(0x123456, 0x1234 + 8, 5), Error::none);
  EXPECT_EQ(error(0x123456, 0x1234 + 16, 5), Error::cross_check_failed);
  EXPECT_EQ(error(0x123456, 0x1234 - 16, 5), Error::cross_check_failed);
  EXPECT_EQ(error(0xFFFFFF, 0, 5), Error::none);
  format.previous_life_counter = 4;
  EXPECT_EQ(error(0x123456, 0x1234, 5), Error::none);
  EXPECT_EQ(error(0x123456, 0x1234, 4), Error::sequence_mismatch);
  format.previous_life_counter = 63;
  EXPECT_EQ(error(0x123456, 0x1234, 0), Error::none);
  EXPECT_EQ(error(0x123456, 0x1234, 1), Error::sequence_mismatch);
}

// Expects that hosts with default options give enough clocks for an encoder that needs 10 us for its position, but not
// for one that needs two clock periods more.
template <class F>
void expect_clocks_of_ten_microseconds() {
  for (const std::uint16_t khz : std::to_array<std::uint16_t>({100, 1'000, 4'400, 10'000})) {
    F format;
    format.ma_khz = khz;
    const Time period = LineSettings{.rate = khz * 1000u}.bits(1);
    const auto read_from = [&](Time latency) {
      testing::ClockedBench<VirtualEncoderOf<F>> bench(line_settings, format, Behaviour{.latency = latency});
      PositionReader<F, false> read(format);
      return bench.run(read).error();
    };
    EXPECT_EQ(read_from(10us), Error::none) << khz;
    EXPECT_EQ(read_from(10us + 2 * period), Error::truncated) << khz;
  }
}

// SLO is low after a frame: identify must not take these zeros for another word.
TEST(BissWords, RejectsZerosAfterFrameAsWord) {
  ChainFormat chain;
  chain.count = 2;
  chain.channels[1].check.inverted = false;
  BitBuffer<512> frame;
  ASSERT_TRUE(encode(Format{.word = chain.channels[0].word, .check = chain.channels[0].check}, {}, frame));
  ASSERT_EQ(detail::decoded(chain, frame.view()).error(), Error::truncated);
  for (int i = 0; i < 200; ++i) frame.append(0, 1);
  EXPECT_EQ(detail::decoded(chain, frame.view()).error(), Error::line_stuck);

  SafetyFormat safety;
  safety.spw.check.inverted = false;
  frame.clear();
  ASSERT_TRUE(encode(Format{.word = safety.cpw.word, .check = safety.cpw.check}, {}, frame));
  for (int i = 0; i < 200; ++i) frame.append(0, 1);
  EXPECT_EQ(detail::decoded(safety, frame.view()).error(), Error::line_stuck);
}

TEST(BissWords, ClocksAreThoseOfTenMicrosecondsAtEveryRate) {
  expect_clocks_of_ten_microseconds<Format>();
  expect_clocks_of_ten_microseconds<ChainFormat>();
  expect_clocks_of_ten_microseconds<SafetyFormat>();
}

TEST(BissWords, EachSlaveOfAChainDelaysStartBitByOneClock) {
  for (unsigned count = 1; count <= ChainFormat::most; ++count) {
    ChainFormat format;
    format.count = static_cast<std::uint8_t>(count);
    testing::ClockedBench<VirtualEncoderOf<ChainFormat>> bench(line_settings, format);
    PositionReader<ChainFormat, false> read(format);
    ASSERT_EQ(bench.run(read).error(), Error::none) << count;
    EXPECT_EQ(read.last().ack_bits, 10 + count - 1);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
    EXPECT_EQ(bench.clock(4 + 10 + count - 1, 1ms, 1'000'000).find('1', 2), 2 + 10 + count - 1);
  }
}

TEST(BissWords, FindsCdsAfterStartBit) {
  const auto place = [](std::initializer_list<std::uint8_t> bytes, std::size_t bits) {
    return place_of_cds({.bytes = {bytes.begin(), bytes.size()}, .bits = bits});
  };
  EXPECT_EQ(place_of_cds(Frame{}), std::nullopt);
  EXPECT_EQ(place({0b1110'0101}, 8), 6u);
  EXPECT_EQ(place({0b0001'0100}, 8), 4u);
  EXPECT_EQ(place({0b1110'0000}, 8), std::nullopt);
  EXPECT_EQ(place({0b1110'0100}, 6), std::nullopt);
  EXPECT_EQ(place({0b1111'1111}, 8), std::nullopt);
}

}  // namespace
}  // namespace absenc::biss
