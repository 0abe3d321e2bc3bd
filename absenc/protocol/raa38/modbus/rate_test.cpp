// SPDX-License-Identifier: Apache-2.0
// How many positions a second come over the line, against what its silences allow.
#include <gtest/gtest.h>

#include <cstdio>

#include "absenc/protocol/raa38/modbus/bench_test.hpp"

namespace absenc::raa38::rtu {
namespace {

TEST(Raa38ModbusRate, AsFastAsTheSilencesAllow) {
  for (std::size_t baud = 0; baud < bauds.size(); ++baud) {
    const Format format{.baud = baud};
    testing::Bench bench(format);
    const Time start = bench.line.now();
    constexpr int readings = 200;
    for (int i = 0; i < readings; ++i) {
      testing::Talk read(format, "position");
      ASSERT_EQ(bench.run(read).error(), Error::none);
    }
    // Silence, 8 characters, silence, the encoder's time, 7 characters.
    const LineSettings line = format.line();
    const Time least = modbus::frame_silence(line) * 2 + 200us + 15 * line.character();
    const double ratio = std::chrono::duration<double>(least * readings) / (bench.line.now() - start);
    std::printf("%u baud: %.1f positions a second, %.3f of what the line allows\n", bauds[baud],
                readings / std::chrono::duration<double>(bench.line.now() - start).count(), ratio);
    EXPECT_GT(ratio, 0.95);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

}  // namespace
}  // namespace absenc::raa38::rtu
