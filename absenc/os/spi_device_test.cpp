// SPDX-License-Identifier: Apache-2.0
// Tests which bits a controller samples and which events a device gets, edge by edge.
#include "absenc/os/spi_device.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "absenc/os/testing.hpp"
#include "tests/shape_toys.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;
using ::testing::HasSubstr;
using ByteToy = toy::Toy<std::uint8_t>;

constexpr LineSettings chip_settings{.rate = 1'000'000, .spi_mode = 1};
const Data driven{0x95, 0xC6, 0x12};
const Data sent{0xA7, 0x01, 0x80};

// A reference model of the SPI wires: controller and chip as shift registers, simulated edge by edge.
struct Wires {
  explicit Wires(std::uint8_t host, std::uint8_t chip) : host_mode(host), chip_mode(chip) {}

  static bool bit(const Data& bytes, std::size_t index) {
    return index >= 8 * bytes.size() || (bytes[index / 8] >> (7 - index % 8) & 1) != 0;
  }
  static void keep(Data& bytes, bool value) {
    bytes.back() = static_cast<std::uint8_t>(bytes.back() << 1 | (value ? 1 : 0));
  }

  void run() {
    if ((host_mode & 1) == 0) mosi = bit(sent, host_shifts++);
    if ((chip_mode & 1) == 0) miso = bit(driven, chip_shifts++);
    bool level = (host_mode & 2) != 0;
    for (std::size_t edge = 0; edge < 16 * sent.size(); ++edge) {
      if (edge % 16 == 0) {
        sampled.push_back(0);
        received_bytes.push_back(0);
      }
      level = !level;
      const bool old_mosi = mosi;
      const bool old_miso = miso;
      const bool host_samples = (edge % 2 == 1) == ((host_mode & 1) != 0);
      const bool chip_samples = level == (chip_mode == 0 || chip_mode == 3);
      if (host_samples) {
        keep(sampled, old_miso);
      } else if (host_shifts < 8 * sent.size()) {
        mosi = bit(sent, host_shifts++);
      }
      if (chip_samples) {
        keep(received_bytes, old_mosi);
      } else {
        miso = bit(driven, chip_shifts++);
      }
    }
  }

  std::uint8_t host_mode;
  std::uint8_t chip_mode;
  bool mosi = false;
  bool miso = true;
  std::size_t host_shifts = 0;
  std::size_t chip_shifts = 0;
  Data sampled;
  Data received_bytes;
};

ByteToy chip(Data* received_bytes = nullptr) {
  return ByteToy([received_bytes](auto& self, const ByteEvent& event) {
    if (event.kind == ByteEvent::Kind::selected) self.send(driven);
    if (event.kind == ByteEvent::Kind::received && received_bytes != nullptr) *received_bytes = data(event.items);
  });
}

struct Exchange {
  Data in;
  std::string log;
  std::uint64_t wrong_modes;
};

Exchange exchange(LinkKind kind, const LineSettings& settings, std::vector<SpiTransfer> transfers, Time start = 1ms) {
  ByteToy toy = chip();
  toy.idle.at = never;
  SpiDevice device(kind, settings, toy);
  std::size_t size = 0;
  for (const SpiTransfer& transfer : transfers) size += transfer.size;
  Data in(size);
  std::size_t done = 0;
  for (SpiTransfer& transfer : transfers) {
    transfer.in = MutableBytes(in).subspan(done, transfer.size);
    done += transfer.size;
  }
  device.message(transfers, start);
  return {in, toy.log, device.wrong_modes()};
}

TEST(SpiDevice, EveryModeOnEveryChip) {
  for (std::uint8_t chip_mode = 0; chip_mode < 4; ++chip_mode) {
    for (std::uint8_t mode = 0; mode < 4; ++mode) {
      Data received_bytes;
      ByteToy toy = chip(&received_bytes);
      SpiDevice device(LinkKind::spi, {.rate = 1'000'000, .spi_mode = chip_mode}, toy);
      Data in(sent.size());
      const SpiTransfer transfer{.size = in.size(), .out = sent, .in = in, .rate = 1'000'000, .mode = mode};
      device.message({&transfer, 1}, 1ms);
      Wires wires(mode, chip_mode);
      wires.run();
      EXPECT_EQ(in, wires.sampled) << int{mode} << " on " << int{chip_mode};
      EXPECT_EQ(received_bytes, wires.received_bytes) << int{mode} << " on " << int{chip_mode};
      EXPECT_EQ(device.wrong_modes(), mode == chip_mode ? 0u : 1u);
      if (mode == chip_mode) {
        EXPECT_EQ(in, driven);
        EXPECT_EQ(received_bytes, sent);
      }
    }
  }
}

// Clocked devices latch at the first falling edge and shift at each later rising edge.
TEST(SpiDevice, EveryModeOnAClockedDevice) {
  for (std::uint8_t idle = 0; idle < 2; ++idle) {
    for (std::uint8_t mode = 0; mode < 4; ++mode) {
      const LineSettings settings{.rate = 1'000'000, .spi_mode = 3, .idle_clocks = idle};
      const Exchange result = exchange(LinkKind::clocked, settings, {{.size = 4, .rate = 1'000'000, .mode = mode}});
      Data expected;
      std::size_t shifts = 0;
      bool latched = false;
      bool level = (mode & 2) != 0;
      for (std::size_t edge = 0; edge < 64; ++edge) {
        if (edge % 16 == 0) expected.push_back(0);
        const bool wire = shifts < idle || Wires::bit(driven, shifts - idle);
        if ((edge % 2 == 1) == ((mode & 1) != 0)) Wires::keep(expected, wire);
        level = !level;
        if (level && latched) ++shifts;
        latched = latched || !level;
      }
      EXPECT_EQ(result.in, expected) << int{mode} << " idle " << int{idle};
      EXPECT_EQ(result.wrong_modes, mode >= 2 ? 0u : 1u) << int{mode};
    }
  }
}

TEST(SpiDevice, ReportsSelectionToChip) {
  const SpiTransfer wait{.rate = 1, .mode = 1, .delay = 5us};
  const SpiTransfer bytes{.size = 2, .rate = 500'000, .mode = 1, .delay = 3us};
  EXPECT_EQ(exchange(LinkKind::spi, chip_settings, {wait, bytes}).log,
            "1000000 selected, 1040000 received 00 00, 1040000 sent 16 2000");
  SpiTransfer apart = bytes;
  apart.deselect = true;
  EXPECT_EQ(exchange(LinkKind::spi, chip_settings, {apart, bytes}).log,
            "1000000 selected, 1035000 received 00 00, 1035000 sent 16 2000, 1045000 selected, "
            "1080000 received 00 00, 1080000 sent 16 2000");
}

TEST(SpiDevice, ReportsPeriodAndPausesToClockedDevice) {
  const LineSettings settings{.rate = 200'000, .spi_mode = 3};
  const SpiTransfer wait{.rate = 1, .mode = 3, .delay = 5us};
  const SpiTransfer bytes{.size = 1, .rate = 200'000, .mode = 3};
  EXPECT_EQ(exchange(LinkKind::clocked, settings, {wait, bytes, bytes}).log, "1005000 selected 5000, 1085000 sent 16");
  SpiTransfer pausing = bytes;
  pausing.delay = 7us;
  EXPECT_EQ(exchange(LinkKind::clocked, settings, {pausing, bytes}).log,
            "1000000 selected 5000, 1040000 sent 8, 1047000 selected 5000, 1087000 sent 8");
  pausing.delay = {};
  pausing.deselect = true;
  EXPECT_EQ(exchange(LinkKind::clocked, settings, {pausing, bytes}).log,
            "1000000 selected 5000, 1040000 sent 8, 1050000 selected 5000, 1090000 sent 8");
  pausing.delay = 7us;
  EXPECT_EQ(exchange(LinkKind::clocked, settings, {pausing}).log, "1000000 selected 5000, 1040000 sent 8");
}

TEST(SpiDevice, TheFastestClockOfAFrameCounts) {
  const SpiTransfer slow{.size = 1, .rate = 500'000, .mode = 1};
  const SpiTransfer fast{.size = 1, .rate = 4'000'000, .mode = 1};
  EXPECT_THAT(exchange(LinkKind::spi, chip_settings, {slow, fast, slow}).log, HasSubstr("1034000 sent 24 250"));
}

TEST(SpiDevice, ChipThatStaysSelectedContinues) {
  Data received_bytes;
  ByteToy toy = chip(&received_bytes);
  SpiDevice device(LinkKind::spi, chip_settings, toy);
  Data in(3);
  SpiTransfer first{
      .size = 1, .out = Bytes(sent).first(1), .in = MutableBytes(in).first(1), .rate = 1'000'000, .mode = 1};
  first.deselect = true;
  const SpiTransfer second{
      .size = 2, .out = Bytes(sent).subspan(1), .in = MutableBytes(in).subspan(1), .rate = 1'000'000, .mode = 1};
  EXPECT_EQ(device.message({&first, 1}, 1ms), 1ms + 8us);
  EXPECT_TRUE(received_bytes.empty());
  EXPECT_EQ(device.message({&second, 1}, 2ms), 2ms + 16us);
  EXPECT_EQ(in, driven);
  EXPECT_EQ(received_bytes, sent);
}

TEST(SpiDevice, LimitsMemoryForChipThatStaysSelected) {
  Data received_bytes;
  ByteToy toy = chip(&received_bytes);
  SpiDevice device(LinkKind::spi, chip_settings, toy);
  const Data out(4000, 0xA5);
  SpiTransfer transfer{.size = out.size(), .out = out, .rate = 1'000'000, .mode = 1, .deselect = true};
  for (int i = 0; i < 3; ++i) device.message({&transfer, 1}, 1ms);
  transfer.deselect = false;
  device.message({&transfer, 1}, 1ms);
  EXPECT_EQ(received_bytes, Data(4096, 0xA5));
  EXPECT_THAT(toy.log, HasSubstr("sent 128000 1000"));
}

TEST(SpiDevice, BitsInTheOtherOrder) {
  Data received_bytes;
  ByteToy toy = chip(&received_bytes);
  SpiDevice device(LinkKind::spi, chip_settings, toy);
  Data in(3);
  const SpiTransfer transfer{.size = in.size(), .out = sent, .in = in, .rate = 1'000'000, .mode = 1, .lsb_first = true};
  device.message({&transfer, 1}, 1ms);
  EXPECT_EQ(in, (Data{0xA9, 0x63, 0x48}));
  EXPECT_EQ(received_bytes, (Data{0xE5, 0x80, 0x01}));
}

TEST(SpiDevice, WithoutBuffersNothingIsClocked) {
  ByteToy toy = chip();
  SpiDevice device(LinkKind::spi, chip_settings, toy);
  const SpiTransfer transfer{.size = 5, .rate = 1'000'000, .mode = 1, .delay = 4us};
  EXPECT_EQ(device.message({&transfer, 1}, 1ms), 1ms + 4us);
  EXPECT_EQ(toy.log, "1000000 selected, 1004000 received, 1004000 sent");
}

TEST(SpiDevice, WakesTheDeviceOnceAtItsTimer) {
  ByteToy toy = chip();
  SpiDevice device(LinkKind::spi, chip_settings, toy);
  EXPECT_EQ(device.timer(), never);
  toy.idle.at = 5ms;
  const SpiTransfer transfer{.size = 1, .out = Bytes(sent).first(1), .rate = 1'000'000, .mode = 1};
  device.message({&transfer, 1}, 1ms);
  EXPECT_EQ(device.timer(), 5ms);
  toy.log.clear();
  device.wake(4ms);
  EXPECT_EQ(toy.log, "");
  device.wake(6ms);
  EXPECT_EQ(toy.log, "6000000 timer");
  EXPECT_EQ(device.timer(), never);  // the device requested a time in the past, which sets no timer
}

TEST(SpiDevice, HasNoOtherLinks) {
  ByteToy toy;
  EXPECT_THROW(SpiDevice(LinkKind::full_duplex, chip_settings, toy), std::invalid_argument);
}

}  // namespace
}  // namespace absenc::os
