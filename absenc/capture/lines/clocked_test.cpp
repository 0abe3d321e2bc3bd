// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/lines/clocked.hpp"

#include <gtest/gtest.h>

#include <array>

#include "absenc/capture/files/memory_reader_test.hpp"
#include "absenc/capture/lines/pipeline.hpp"

namespace absenc::capture {
namespace {

// A drawing of a clock with data lines and optional chip select, with 4 ticks per clock period.
struct ClockedDrawing {
  Wires wires{std::vector<Drawn>(4)};  // levels of the wires clock, in, out and select, in this order

  void hold(bool clock, bool in, bool out, bool select, std::size_t ticks) {
    const std::array levels{clock, in, out, select};
    for (std::size_t i = 0; i < 4; ++i) wires.levels[i].insert(wires.levels[i].end(), ticks, levels[i]);
  }
  void idle(std::size_t ticks, bool clock = true, bool select = true) { hold(clock, true, true, select, ticks); }
  // Draws an SSI word: the first falling edge latches it, each rising edge brings the next bit.
  void ssi(std::uint32_t word, unsigned bits) {
    hold(false, true, true, true, 2);
    for (unsigned i = bits; i-- > 0;) {
      const bool bit = (word >> i & 1) != 0;
      hold(true, bit, true, true, 2);
      hold(false, bit, true, true, 2);
    }
    hold(true, false, true, true, 1);
  }
  // Draws a byte in SPI mode 0 or 3, depending on the idle level of the clock.
  void spi(std::uint8_t out, std::uint8_t in) {
    for (unsigned i = 8; i-- > 0;) {
      hold(false, (in >> i & 1) != 0, (out >> i & 1) != 0, false, 2);
      hold(true, (in >> i & 1) != 0, (out >> i & 1) != 0, false, 2);
    }
  }
};

struct DecodedBursts {
  std::vector<Burst> bursts;
  ClockedOutcome outcome;
};

DecodedBursts decoded(const Wires& wires, const ClockedLine& line, unsigned threads = 2) {
  MemoryReader reader(wires, Content::samples, 50, 1);
  DecodedBursts all;
  all.outcome = decode_clocked(reader, line, threads, [&](const DecodedPart& part) {
    all.bursts.insert(all.bursts.end(), part.bursts.begin(), part.bursts.end());
    return true;
  });
  return all;
}

TEST(Clocked, SsiWordsEndAtPauses) {
  ClockedDrawing drawing;
  drawing.idle(100);
  for (const std::uint32_t word : {0x1EFu, 0xA5Au, 0x800u}) {
    drawing.ssi(word, 12);
    drawing.idle(100);
  }
  const DecodedBursts all = decoded(drawing.wires, {.clock = 0, .in = 1, .rising = false});
  EXPECT_EQ(all.outcome.problem, "");
  EXPECT_EQ(all.outcome.pause, 12u);
  ASSERT_EQ(all.bursts.size(), 3u);
  // At the first falling edge of the clock the decoder samples the idle data line, so each burst has one bit more than
  // the word.
  EXPECT_EQ(all.bursts[0].bits, 13u);
  EXPECT_EQ(all.bursts[0].in, (std::vector<std::uint8_t>{0x8F, 0x78}));
  EXPECT_EQ(all.bursts[1].in, (std::vector<std::uint8_t>{0xD2, 0xD0}));
  EXPECT_EQ(all.bursts[0].begin, 100u);
  EXPECT_EQ(all.bursts[0].end, 100u + 50);
  EXPECT_TRUE(all.bursts[0].out.empty());
  EXPECT_FALSE(all.bursts[0].cut || all.bursts[2].cut);
}

TEST(Clocked, MarksIncompleteWordsAsCut) {
  ClockedDrawing drawing;
  drawing.idle(3);
  drawing.ssi(0x1EF, 12);
  drawing.idle(100);
  drawing.ssi(0x1EF, 12);
  drawing.idle(100);
  drawing.ssi(0x1EF, 12);
  const DecodedBursts all = decoded(drawing.wires, {.clock = 0, .in = 1, .rising = false});
  ASSERT_EQ(all.bursts.size(), 3u);
  EXPECT_TRUE(all.bursts[0].cut);
  EXPECT_FALSE(all.bursts[1].cut);
  EXPECT_TRUE(all.bursts[2].cut);
  EXPECT_EQ(all.bursts[2].bits, 13u);
}

TEST(Clocked, SpiTakesBothDirectionsBetweenEdgesOfChipSelect) {
  for (const bool idle_clock : {false, true}) {
    ClockedDrawing drawing;
    drawing.idle(20, idle_clock);
    drawing.spi(0x12, 0xF1);
    // the clock pauses here while chip select is active, which does not end the burst
    drawing.hold(idle_clock, true, true, false, 60);
    drawing.spi(0x34, 0x0E);
    drawing.idle(10, idle_clock);
    drawing.hold(!idle_clock, true, true, true, 4);  // a clock for another chip, while chip select is inactive
    drawing.idle(10, idle_clock);
    drawing.spi(0x56, 0x81);
    drawing.idle(10, idle_clock);
    const DecodedBursts all = decoded(drawing.wires, {.clock = 0, .in = 1, .out = 2, .select = 3, .rising = true});
    ASSERT_EQ(all.bursts.size(), 2u) << idle_clock;
    EXPECT_EQ(all.bursts[0].bits, 16u);
    EXPECT_EQ(all.bursts[0].in, (std::vector<std::uint8_t>{0xF1, 0x0E}));
    EXPECT_EQ(all.bursts[0].out, (std::vector<std::uint8_t>{0x12, 0x34}));
    EXPECT_EQ(all.bursts[0].begin, 20u);
    EXPECT_EQ(all.bursts[0].end, 20u + 124);
    EXPECT_EQ(all.bursts[1].in, (std::vector<std::uint8_t>{0x81}));
  }
}

TEST(Clocked, AClockThatNeverPausesIsCutIntoPieces) {
  ClockedDrawing drawing;
  drawing.idle(100);
  for (std::size_t i = 0; i < ClockedDecoder::most_bits + 100; ++i) {
    drawing.hold(false, true, true, true, 1);
    drawing.hold(true, true, true, true, 1);
  }
  drawing.idle(100);
  for (const unsigned threads : {1u, 3u}) {
    const DecodedBursts all = decoded(drawing.wires, {.clock = 0, .in = 1, .rising = false}, threads);
    ASSERT_EQ(all.bursts.size(), 2u);
    EXPECT_EQ(all.bursts[0].bits, ClockedDecoder::most_bits);
    EXPECT_EQ(all.bursts[1].bits, 100u);
    EXPECT_TRUE(all.bursts[0].cut && all.bursts[1].cut);
  }
}

TEST(Clocked, ReportsWhyLineCannotBeDecoded) {
  ClockedDrawing drawing;
  drawing.idle(200);
  const std::string no_clock =
      "D0 never changes its level, so there is no clock: is it the right channel, and was it connected?";
  EXPECT_EQ(decoded(drawing.wires, {.clock = 0, .in = 1}).outcome.problem, no_clock);
  EXPECT_EQ(decoded(drawing.wires, {.clock = 0, .in = 1, .select = 3}).outcome.problem, no_clock);
  EXPECT_EQ(decoded(drawing.wires, {.clock = 0, .in = 1, .pause = 20}).outcome.problem, no_clock);
  EXPECT_EQ(decoded(drawing.wires, {.clock = 0}).outcome.problem, "no channel with data was named: name at least one");
  drawing.hold(false, true, true, true, 1);
  EXPECT_EQ(decoded(drawing.wires, {.clock = 0, .in = 1}).outcome.problem,
            "D0 changes its level only 1 times, its data 0 times, so there is no word: is it the right channel?");
  drawing.ssi(0x1EF, 12);
  EXPECT_EQ(decoded(drawing.wires, {.clock = 0, .in = 1, .select = 3}).outcome.problem.substr(0, 18),
            "D3 is never active");
}

}  // namespace
}  // namespace absenc::capture
