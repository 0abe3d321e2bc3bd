// SPDX-License-Identifier: Apache-2.0
// Tests the firmware adapters in docs/firmware.md with stubs of the hardware.
#include <gtest/gtest.h>

#include <array>
#include <deque>
#include <vector>

#include "absenc/protocol/biss/host.hpp"
#include "absenc/protocol/raa38/can/host.hpp"
#include "absenc/protocol/ssi/host.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "firmware/hookup/can_fifo.hpp"
#include "firmware/hookup/spi_dma.hpp"
#include "firmware/hookup/uart_dma.hpp"

namespace absenc::firmware {
namespace {

using namespace std::chrono_literals;

// ---- A UART with a DMA receiver

constexpr auto reply = std::to_array<std::uint8_t>({0x1A, 0x00, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00, 0x4A});

struct Uart {
  bool drives = false;
  std::vector<std::uint8_t> transmitted{};
  MutableBytes buffer{};  // the buffer into which the DMA receives; empty while the DMA does not run
  std::size_t count = 0;

  void drive(bool on) { drives = on; }
  void transmit(Bytes bytes) {
    EXPECT_TRUE(drives);
    transmitted.assign(bytes.begin(), bytes.end());
  }
  void receive(MutableBytes into) {
    buffer = into;
    count = 0;
  }
  std::size_t stop_receiving() {
    buffer = {};
    return count;
  }
  void set_rate(std::uint32_t) {}

  // Delivers bytes from the encoder into the buffer of the DMA. Returns whether the buffer is full.
  bool deliver(Bytes bytes) {
    EXPECT_FALSE(drives);
    for (const std::uint8_t byte : bytes) {
      EXPECT_LT(count, buffer.size()) << "nobody takes it";
      if (count < buffer.size()) buffer[count++] = byte;
    }
    return count == buffer.size();
  }
};

struct UartDmaTest : testing::Test {
  Uart uart;
  UartDma<Uart> line{uart, 50us};
  tformat::ReadPosition read{tformat::Format{}};

  UartDmaTest() {
    line.start(read, 5us);
    EXPECT_EQ(uart.transmitted, std::vector<std::uint8_t>{0x1A});
    line.transmission_complete(9us);
  }
  void expect_position() {
    EXPECT_FALSE(line.is_busy());
    ASSERT_NE(read.reading(), nullptr);
    EXPECT_EQ(read.reading()->singleturn, 0x12345u);
  }
};

TEST_F(UartDmaTest, WholeReplyEndsTransfer) {
  // the DMA's buffer is full at the last character of the reply, before the line becomes idle
  EXPECT_TRUE(uart.deliver(reply));
  line.arrived(56us);
  expect_position();
}

TEST_F(UartDmaTest, AssemblesReplyFromPiecesAtIdleLine) {
  EXPECT_FALSE(uart.deliver(std::span(reply).first(4)));
  line.arrived(30us);
  EXPECT_TRUE(line.is_busy());
  EXPECT_FALSE(uart.deliver(std::span(reply).subspan(4)));
  line.arrived(60us);
  expect_position();
}

TEST_F(UartDmaTest, RejectsShortReply) {
  EXPECT_FALSE(uart.deliver(std::span(reply).first(10)));
  line.arrived(52us);
  line.tick(1s);
  EXPECT_FALSE(line.is_busy());
  EXPECT_EQ(read.error(), Error::wrong_length);
}

// ---- An SPI controller

struct Spi {
  MutableBytes buffer{};
  unsigned transfers = 0;

  void clock(MutableBytes into) {
    buffer = into;
    ++transfers;
  }
  void set_rate(std::uint32_t) {}
  // Fills the receive buffer of the SPI controller with `idle` one bits, then the bits of the word, then one bits.
  void deliver(Bytes bytes, unsigned idle) {
    for (std::size_t bit = 0; bit < 8 * buffer.size(); ++bit) {
      const std::size_t at = bit - idle;
      const bool one = bit < idle || at >= 8 * bytes.size() || (bytes[at / 8] >> (7 - at % 8) & 1) != 0;
      const auto mask = static_cast<std::uint8_t>(0x80u >> (bit % 8));
      buffer[bit / 8] = static_cast<std::uint8_t>(one ? buffer[bit / 8] | mask : buffer[bit / 8] & ~mask);
    }
  }
};

template <class Read>
void read_by_spi(Read& read, const LineSettings& settings, Bytes bits) {
  Spi spi;
  SpiDma<Spi> line{spi, settings};
  line.start(read, 0us);
  for (Time now = 1ms; line.is_busy() && now < 1s; now += 1ms) {
    line.tick(now);
    if (spi.transfers == 0) continue;
    spi.transfers = 0;
    spi.deliver(bits, settings.idle_clocks);
    line.done(now);
  }
  EXPECT_FALSE(line.is_busy());
}

TEST(SpiDmaTest, ReadsBiss) {
  biss::ReadPosition read{biss::Format{}};
  read_by_spi(read, biss::line_settings, std::to_array<std::uint8_t>({0xC0, 0x28, 0x65, 0x1F, 0xE6, 0x00, 0x00, 0x00}));
  ASSERT_NE(read.reading(), nullptr) << static_cast<int>(read.error());
}

// The array `bits` begins behind the idle level that the controller samples at the first clock.
TEST(SpiDmaTest, ReadsSsiAfterIdleClock) {
  constexpr auto bits = std::to_array<std::uint8_t>({0x1E, 0xF0, 0x00, 0x00});
  ssi::ReadPosition read{ssi::Format{}};
  read_by_spi(read, ssi::line_settings, bits);
  ASSERT_NE(read.reading(), nullptr) << static_cast<int>(read.error());
  ASSERT_EQ(ssi::line_settings.idle_clocks, 1);
  EXPECT_EQ(read.exchange().received[0], bits[0]);
  EXPECT_EQ(read.exchange().received[1], bits[1]);
}

// ---- A CAN controller

struct Can {
  std::vector<CanFrame> transmitted{};
  std::deque<CanFrame> fifo{};

  void transmit(const CanFrame& frame) { transmitted.push_back(frame); }
  std::optional<CanFrame> take() {
    if (fifo.empty()) return std::nullopt;
    const CanFrame frame = fifo.front();
    fifo.pop_front();
    return frame;
  }
  void set_rate(std::uint32_t) {}
};

TEST(CanFifoTest, ReadsPositionAmongOtherFrames) {
  Can can;
  CanFifo<Can> line{can, 1ms};
  raa38::can::Read read{raa38::can::Format{}, raa38::can::Read::Mode::ask};
  line.start(read, 0us);
  Time now = 1ms;
  for (; can.transmitted.empty() && now < 1s; now += 1ms) line.tick(now);
  ASSERT_EQ(can.transmitted.size(), 1u);
  line.transmitted(now);
  can.fifo = {{.id = 0x7FF, .size = 1}, {.id = 0x120, .size = 8, .data = {0x20}}};
  line.pending(now += 200us);
  EXPECT_FALSE(line.is_busy());
  ASSERT_NE(read.reading(), nullptr) << static_cast<int>(read.error());
}

}  // namespace
}  // namespace absenc::firmware
