// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/captures/position_trace.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace absenc::client {
namespace {

Reading position(std::uint64_t counts, std::uint64_t turns = 0, bool with_turns = false) {
  return {.singleturn = counts,
          .multiturn = turns,
          .singleturn_bits = 12,
          .multiturn_bits = with_turns ? 16u : 0u,
          .singleturn_valid_bits = 12,
          .multiturn_valid = with_turns};
}

std::string line_of(const std::string& plot, std::size_t number) {
  std::size_t from = 0;
  for (; number > 0; --number) from = plot.find('\n', from) + 1;
  return plot.substr(from, plot.find('\n', from) - from);
}

TEST(PositionTrace, NothingIsNoPlot) {
  PositionTrace trace;
  EXPECT_EQ(trace.plot(), "");
  Reading invalid = position(5);
  invalid.singleturn_valid_bits = 0;
  trace.add(0, invalid);
  EXPECT_EQ(trace.plot(), "");
}

TEST(PositionTrace, TurnsBelowZeroAreBelowThoseAbove) {
  PositionTrace trace;
  for (std::int64_t turn = -4; turn <= 4; ++turn) {
    Reading reading = position(0, static_cast<std::uint64_t>(turn) & 0xFFFF, true);
    reading.multiturn_signed = true;
    trace.add(static_cast<std::uint64_t>(turn + 4), reading);
  }
  const std::string plot = trace.plot();
  EXPECT_NE(line_of(plot, 0).find(" 4.000 turns |"), std::string::npos) << plot;
  EXPECT_NE(line_of(plot, 9).find("-4.000 turns |*"), std::string::npos) << plot;
}

// Checks that a plot shows the whole capture if the capture has more than 10^12 ticks.
TEST(PositionTrace, ARampFillsTheDiagonal) {
  PositionTrace trace;
  for (std::uint64_t i = 0; i < 4096; ++i) trace.add(1000 + i * 1'000'000'000, position(i));
  EXPECT_EQ(trace.last() - trace.first(), std::uint64_t{4095} * 1'000'000'000);
  const std::string plot = trace.plot();
  EXPECT_EQ(std::count(plot.begin(), plot.end(), '\n'), 10);
  const std::string top = line_of(plot, 0);
  const std::string bottom = line_of(plot, 9);
  EXPECT_NE(top.find("359.9 deg |"), std::string::npos) << plot;
  EXPECT_NE(bottom.find("0.0 deg |*"), std::string::npos) << plot;
  EXPECT_EQ(top.find("|*"), std::string::npos);
  EXPECT_GT(top.find('*'), bottom.rfind('*')) << plot;
}

TEST(PositionTrace, TurnsGoOn) {
  PositionTrace trace;
  for (std::uint64_t i = 0; i < 200; ++i) trace.add(i, position(i % 2 * 2048, i / 2, true));
  trace.add(200, position(4095));  // the plot must leave out a position that has no turns
  EXPECT_EQ(trace.count(), 200u);
  EXPECT_NE(line_of(trace.plot(), 0).find("99.50 turns"), std::string::npos) << trace.plot();
}

TEST(PositionTrace, MillimetresOfALinearEncoder) {
  PositionTrace trace;
  Reading reading = position(1000);
  reading.unit_um = 2;
  trace.add(0, reading);
  reading.singleturn = 3000;
  trace.add(1, reading);
  EXPECT_NE(line_of(trace.plot(), 0).find("6.000 mm"), std::string::npos) << trace.plot();
  EXPECT_NE(line_of(trace.plot(), 9).find("2.000 mm"), std::string::npos) << trace.plot();
}

}  // namespace
}  // namespace absenc::client
