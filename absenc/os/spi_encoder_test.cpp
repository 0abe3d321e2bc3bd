// SPDX-License-Identifier: Apache-2.0
// The hosts of biss and ssi, and one of an exchange, on an SPI port whose far side is a virtual encoder.
#include <gtest/gtest.h>

#include "absenc/host/drive.hpp"
#include "absenc/os/fake_spi_test.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/ssi/device.hpp"
#include "absenc/protocol/ssi/host.hpp"
#include "absenc/sim/sim_port.hpp"
#include "tests/shape_toys.hpp"

namespace absenc::os {
namespace {

using namespace testing;

// A simulated line behind the controller, in the controller's time.
class FarSide {
 public:
  FarSide(LinkKind kind, FakeSpi& kernel, Machine<std::uint8_t>& device)
      : kind_(kind),
        kernel_(&kernel),
        port_(kind, {.rate = kernel.speed}, device, {.now = os::now, .sleep_until = os::sleep_until}) {
    kernel.far_side = [this](Bytes mosi, MutableBytes miso) { answer(mosi, miso); };
  }

  /// The encoder's first bit comes with the first rising edge. The controller has taken its first sample then: at the
  /// falling edge before (mode 2), or at this one (mode 3), when the line still shows what was there.
  bool shifts_after_sample = false;

 private:
  void answer(Bytes mosi, MutableBytes miso) {
    // The clock of a clocked link idles high; 8 clocks come for each byte.
    EXPECT_EQ((kernel_->mode & SPI_CPOL) != 0, kind_ == LinkKind::clocked);
    EXPECT_EQ(kernel_->bits, 8);
    port_.begin({.kind = ByteStep::Kind::configure, .settings = {.rate = kernel_->speed}});
    port_.begin({.kind = ByteStep::Kind::transfer, .out = mosi, .bits = 8 * miso.size()});
    ByteEvent event{};
    while (event.kind != ByteEvent::Kind::received) event = port_.wait({.at = never});
    ASSERT_EQ(event.items.size(), miso.size());
    std::uint8_t before = 0xFF;  // the idle line
    for (std::size_t i = 0; i < miso.size(); ++i) {
      const std::uint8_t now = event.items[i];
      miso[i] = shifts_after_sample ? static_cast<std::uint8_t>(before << 7 | now >> 1) : now;
      before = now;
    }
  }

  LinkKind kind_;
  FakeSpi* kernel_;
  sim::SimPort<std::uint8_t> port_;
};

bool run(Machine<std::uint8_t>& host, SpiPort& port) {
  return host::drive(host, port, [] { return true; });
}

struct SpiEncoder : ::testing::Test {
  FakeSpi kernel;
  biss::testing::TestShaft shaft;
};

TEST_F(SpiEncoder, SsiOfEveryLength) {
  for (const unsigned bits : {7u, 8u, 12u, 13u, 25u}) {
    WordFormat word;
    word.add({"position", Meaning::position, bits});
    const ssi::Format format{.word = word};
    ssi::VirtualEncoder encoder(format, shaft);
    encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    FakeSpi controller;
    FarSide far(LinkKind::clocked, controller, encoder);
    far.shifts_after_sample = true;
    SpiPort port(FakeSpi::path, LinkKind::clocked, ssi::line_settings, {}, controller);
    for (const std::int64_t position : {0x95C6'1234L, 0x3A59'8DE1L, 0xFFFF'FFFEL}) {
      shaft.state.position = position;
      ssi::ReadPosition read(format);
      ASSERT_TRUE(run(read, port));
      ASSERT_EQ(read.error(), Error::none) << bits;
      EXPECT_EQ(read.word(), encoder.word({})) << bits;
    }
    EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
  }
}

TEST_F(SpiEncoder, SsiReadTwice) {
  const WordFormat word = "position:13"_word;
  const ssi::Format format{.word = word, .extra_clocks = 13};
  ssi::VirtualEncoder encoder(format, shaft);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  FarSide far(LinkKind::clocked, kernel, encoder);
  far.shifts_after_sample = true;
  SpiPort port(FakeSpi::path, LinkKind::clocked, ssi::line_settings, {}, kernel);
  shaft.state.position = 0x95C6'1234;
  ssi::ReadPosition read(format);
  ASSERT_TRUE(run(read, port));
  EXPECT_EQ(read.error(), Error::none);
  EXPECT_EQ(read.word(), encoder.word({}));
}

TEST_F(SpiEncoder, Biss) {
  const biss::Format format{.word = "multiturn:16 position:19 error:1! warning:1!"_word};
  biss::VirtualEncoder encoder(format, shaft);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  const FarSide far(LinkKind::clocked, kernel, encoder);
  SpiPort port(FakeSpi::path, LinkKind::clocked, biss::line_settings, {}, kernel);
  for (const std::uint32_t rate : {200'000u, 1'000'000u, 4'000'000u}) {
    shaft.state.position += 0x1'8673'2468;
    biss::ReadPosition read(format, {.rate = rate, .latency = std::chrono::microseconds(10)});
    ASSERT_TRUE(run(read, port));
    ASSERT_EQ(read.error(), Error::none) << rate;
    EXPECT_EQ(read.reply().word, encoder.encoder().word({})) << rate;
    EXPECT_EQ(kernel.speed, rate);
  }
  EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
}

TEST_F(SpiEncoder, NobodyThere) {
  SpiPort port(FakeSpi::path, LinkKind::clocked, biss::line_settings, {}, kernel);
  biss::ReadPosition read({}, {});
  ASSERT_TRUE(run(read, port));
  EXPECT_EQ(read.error(), Error::line_stuck);
}

TEST_F(SpiEncoder, Exchange) {
  toy::Toy<std::uint8_t> device([](auto& self, const ByteEvent& event) {
    if (event.kind == ByteEvent::Kind::selected) self.send({0xA1, 0xB2, 0xC3});
  });
  const FarSide far(LinkKind::exchange, kernel, device);
  SpiPort port(FakeSpi::path, LinkKind::exchange, {.rate = 1'000'000, .spi_mode = 1}, {}, kernel);
  Data heard;
  toy::Toy<std::uint8_t> host([&](auto& self, const ByteEvent& event) {
    if (event.kind != ByteEvent::Kind::received) return;
    heard = data(event.items);
    self.finish();
  });
  host.idle.at = never;
  host.send({0x11, 0x22}, {}, 0, 4);
  ASSERT_TRUE(run(host, port));
  EXPECT_EQ(heard, (Data{0xA1, 0xB2, 0xC3, 0xFF}));
  EXPECT_NE(device.log.find("received 11 22 00 00"), std::string::npos) << device.log;
}

}  // namespace
}  // namespace absenc::os
