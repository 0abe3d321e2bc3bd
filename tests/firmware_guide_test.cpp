// SPDX-License-Identifier: Apache-2.0
// Tests the first program of docs/firmware.md.
#include "firmware/hookup/first_reading.cpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace {

using namespace std::chrono_literals;

constexpr auto reply = std::to_array<std::uint8_t>({0x1A, 0x00, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00, 0x4A});

Time time_now{};
std::vector<std::uint8_t> transmitted;

}  // namespace

Time now() { return time_now; }
void uart_send(Bytes bytes) { transmitted.assign(bytes.begin(), bytes.end()); }

namespace {

TEST(FirmwareGuide, ReadsPositionAndKeepsItWhenReplyIsMissing) {
  control_cycle();
  EXPECT_EQ(transmitted, std::vector<std::uint8_t>{0x1A});
  time_now += 4us;
  uart_transmission_complete();
  for (const std::uint8_t byte : reply) {
    time_now += 4us;
    uart_byte_received(byte);
  }
  EXPECT_FALSE(encoder.carrier.is_busy());
  EXPECT_EQ(encoder.read->error(), Error::none);
  EXPECT_EQ(encoder.position, 0x12345u);

  control_cycle();
  uart_transmission_complete();
  time_now += 1s;
  timer_tick();
  EXPECT_FALSE(encoder.carrier.is_busy());
  EXPECT_EQ(encoder.read->error(), Error::timeout);
  EXPECT_EQ(encoder.position, 0x12345u);
}

}  // namespace
