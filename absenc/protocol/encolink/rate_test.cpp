// SPDX-License-Identifier: Apache-2.0
// Positions a second while registers are read: channel 3 must not cost a single frame.
#include <gtest/gtest.h>

#include <cstdio>

#include "absenc/protocol/encolink/bench_test.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;

/// Reads the order number (20 bytes: the longest register) and counts its positions.
double positions_a_second(const Format& format, Wire wire) {
  Bench bench(format, wire);
  Time begun{};  // behind the identity, which every register access asks first
  const testing::Told read = bench.run("memory-read", {registers[part_number].address}, [&](const auto&) {
    if (bench.emits == 1) begun = bench.line.now();
  });
  EXPECT_EQ(read.error, Error::none);
  EXPECT_EQ(read.numbers.at("length"), 20);
  const std::uint64_t frames = bench.frames - 2;
  EXPECT_EQ(bench.emits + 1, frames);  // the last one is the end
  EXPECT_GT(frames, 100u);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
  return static_cast<double>(frames - 1) / std::chrono::duration<double>(bench.line.now() - begun).count();
}

class EncolinkRate : public ::testing::TestWithParam<Format> {};

TEST_P(EncolinkRate, UartReachesWhatTheCharactersAllow) {
  const Format format = GetParam();
  const auto characters = static_cast<std::int64_t>(request_bytes + format.frame_bytes());
  const Time frame = characters * uart_settings.character() + answer_time;
  const double most = 1 / std::chrono::duration<double>(frame).count();
  const double reached = positions_a_second(format, Wire::uart);
  std::printf("%zu-byte frames at 1 Mbps: %.0f positions a second of %.0f (%.4f) during register access\n",
              format.frame_bytes(), reached, most, reached / most);
  EXPECT_GE(reached, 0.99 * most);
  EXPECT_LE(reached, 1.001 * most);
}

TEST_P(EncolinkRate, SpiReachesWhatClockAndPauseAllow) {
  const Format format = GetParam();
  const Time frame = spi_lead + spi_settings.bits(8 * format.frame_bytes()) + spi_pause;
  const double most = 1 / std::chrono::duration<double>(frame).count();
  const double reached = positions_a_second(format, Wire::spi);
  EXPECT_GE(reached, 0.99 * most);
  EXPECT_LE(reached, 1.01 * most);
}

INSTANTIATE_TEST_SUITE_P(Formats, EncolinkRate, ::testing::Values(testing::single, testing::multi),
                         [](const auto& test) { return test.param.turns_bytes() == 0 ? "single" : "multi"; });

}  // namespace
}  // namespace absenc::encolink
