// SPDX-License-Identifier: Apache-2.0
// Tests SpiPort's requests to the kernel, and its messages when the kernel refuses.
#include "absenc/os/spi_port.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <numeric>

#include "absenc/os/linux/fake_spi_test.hpp"
#include "absenc/os/signals.hpp"
#include "tests/shape_toys.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;
using Kind = Failure::Kind;
using ::testing::HasSubstr;

constexpr LineSettings encoder_settings{.rate = 4'000'000, .spi_mode = 1};
constexpr LineSettings ssi_settings{.rate = 200'000, .spi_mode = 3, .idle_clocks = 1};
constexpr LineSettings biss_settings{.rate = 1'000'000, .spi_mode = 3};

ByteStep clocks(std::size_t bits) { return {.kind = ByteStep::Kind::transfer, .bits = bits}; }

struct SpiPortTest : ::testing::Test {
  SpiPort open(LinkKind link = LinkKind::spi, const LineSettings& settings = encoder_settings,
               const SpiChoice& choice = {}) {
    if (host_clocks(link)) kernel.connect(link, settings, device);
    return SpiPort(FakeSpi::path, link, settings, choice, kernel);
  }
  std::string refusal(Kind kind, LinkKind link = LinkKind::spi, const LineSettings& settings = encoder_settings) {
    const Failure failure = failure_of([&] { open(link, settings); });
    EXPECT_EQ(failure.kind(), kind) << failure.what();
    return failure.what();
  }
  static Data received(SpiPort& port) {
    EXPECT_EQ(port.wait({.at = never}).kind, ByteEvent::Kind::sent);
    const ByteEvent event = port.wait({.at = never});
    EXPECT_EQ(event.kind, ByteEvent::Kind::received);
    return data(event.items);
  }
  // A device that always sends the same bytes.
  toy::Toy<std::uint8_t> device{[](auto& self, const ByteEvent& event) {
    if (event.kind == ByteEvent::Kind::selected) self.send({0x12, 0x34, 0x56});
  }};
  FakeSpi kernel;
};

TEST_F(SpiPortTest, SetsWordModeAndSpeed) {
  const SpiPort port = open();
  EXPECT_EQ(kernel.log, "bits 8, mode 1, speed 4000000, ");
  EXPECT_EQ(port.settings(), encoder_settings);
}

TEST_F(SpiPortTest, LeavesChipSelectFlags) {
  kernel.settings().mode = SPI_MODE_2 | SPI_CS_HIGH | SPI_LSB_FIRST;
  open();
  EXPECT_EQ(kernel.settings().mode, static_cast<std::uint32_t>(SPI_MODE_1 | SPI_CS_HIGH));
}

TEST_F(SpiPortTest, UserSettingsOverrideProtocol) {
  SpiPort port = open(LinkKind::clocked, biss_settings, {.speed = 400'000, .mode = 2});
  EXPECT_EQ(kernel.log, "bits 8, mode 2, speed 400000, ");
  kernel.log.clear();
  LineSettings other = biss_settings;
  other.rate = 2'000'000;
  port.begin({.kind = ByteStep::Kind::configure, .rate = other.rate});
  EXPECT_EQ(kernel.log, "");
}

TEST_F(SpiPortTest, ConfigureSetsTheSpeedOnlyAndWhenItChanges) {
  SpiPort port = open();
  kernel.log.clear();
  LineSettings other = encoder_settings;
  port.begin({.kind = ByteStep::Kind::configure, .rate = other.rate});
  EXPECT_EQ(kernel.log, "");
  port.begin({.kind = ByteStep::Kind::configure, .rate = 1'000'000});
  EXPECT_EQ(kernel.log, "speed 1000000, ") << "the mode is not the conversation's";
  EXPECT_EQ(port.settings().spi_mode, encoder_settings.spi_mode);
  EXPECT_EQ(port.settings().select_lead, encoder_settings.select_lead);
}

TEST_F(SpiPortTest, ExchangesAsManyBytesAsAreSentOrExpected) {
  SpiPort port = open();
  kernel.log.clear();
  const Data out{0xA5, 0x01};
  port.begin({.kind = ByteStep::Kind::transfer, .out = out, .expect = 4});
  EXPECT_THAT(device.log, HasSubstr("received A5 01 00 00,"));
  EXPECT_EQ(received(port), (Data{0x12, 0x34, 0x56, 0xFF}));
  port.begin({.kind = ByteStep::Kind::transfer, .out = out, .expect = 1});
  EXPECT_EQ(received(port), (Data{0x12, 0x34}));
  EXPECT_EQ(kernel.log, "4 bytes, 2 bytes, ");
}

TEST_F(SpiPortTest, WaitsBetweenChipSelectAndClock) {
  LineSettings slow = encoder_settings;
  slow.select_lead = 4'500ns;  // the time from chip select to the first clock is rounded up to whole microseconds
  SpiPort port = open(LinkKind::spi, slow);
  kernel.log.clear();
  port.begin({.kind = ByteStep::Kind::transfer, .expect = 3});
  EXPECT_EQ(kernel.log, "0 bytes in then 5 us, 3 bytes, ");
  EXPECT_EQ(received(port).size(), 3u);
}

TEST_F(SpiPortTest, ClocksWholeBytesAndHandsOutTheFirstBits) {
  SpiPort port = open(LinkKind::clocked, biss_settings);
  kernel.log.clear();
  port.begin(clocks(13));
  EXPECT_EQ(received(port), (Data{0x12, 0x30}));
  port.begin(clocks(16));
  EXPECT_EQ(received(port), (Data{0x12, 0x34}));
  EXPECT_EQ(kernel.log, "2 bytes in, 2 bytes in, ");
}

TEST_F(SpiPortTest, ClocksOnceMoreForTheIdleLine) {
  SpiPort port = open(LinkKind::clocked, ssi_settings);
  kernel.log.clear();
  port.begin(clocks(13));
  EXPECT_EQ(received(port), (Data{0x12, 0x30}));
  port.begin(clocks(16));
  EXPECT_EQ(received(port), (Data{0x12, 0x34}));
  EXPECT_EQ(kernel.log, "2 bytes in, 3 bytes in, ");
}

TEST_F(SpiPortTest, ReportsLowIdleLine) {
  const auto idle_low = [&](const LineSettings& settings) {
    SpiPort port = open(LinkKind::clocked, settings);
    port.begin(clocks(13));
    EXPECT_EQ(port.wait({.at = never}).kind, ByteEvent::Kind::sent);
    return port.wait({.at = never}).idle_low;
  };
  EXPECT_FALSE(idle_low(ssi_settings));
  kernel.shorted = true;
  EXPECT_TRUE(idle_low(ssi_settings));
  // BiSS is read without idle clocks, so no sample shows the level of the idle line.
  EXPECT_FALSE(idle_low(biss_settings));
}

TEST_F(SpiPortTest, BeginsNotBeforeItsTimeAndStampsTheEnd) {
  SpiPort port = open();
  const Time at = port.now() + 3ms;
  Time begun{};
  device = toy::Toy<std::uint8_t>([&](auto&, const ByteEvent& event) {
    if (event.kind == ByteEvent::Kind::selected) begun = event.at;
  });
  port.begin({.kind = ByteStep::Kind::transfer, .expect = 1, .at = at});
  EXPECT_GE(begun, at);
  EXPECT_LT(begun, at + 1s);
  const ByteEvent sent = port.wait({});
  EXPECT_GE(sent.at, begun);
  EXPECT_EQ(port.wait({}).at, sent.at);
}

TEST_F(SpiPortTest, ReportsTimerGapAndAnswer) {
  SpiPort port = open();
  port.begin({.kind = ByteStep::Kind::transfer, .expect = 1});
  EXPECT_EQ(received(port).size(), 1u);
  const Time at = port.now() + 2ms;
  const ByteEvent timer = port.wait({.at = at, .gap = 1h});
  EXPECT_EQ(timer.kind, ByteEvent::Kind::timer);
  EXPECT_GE(timer.at, at);
  const ByteStep quiet{.at = port.now() + 1h, .answer = 1h, .gap = 3ms};
  const ByteEvent silence = port.wait(quiet);
  EXPECT_EQ(silence.kind, ByteEvent::Kind::silence);
  const Time again = port.now() + 5ms;  // no second silence is reported after the same transfer
  EXPECT_EQ(port.wait({.at = again, .gap = 3ms}).kind, ByteEvent::Kind::timer);
  port.begin({.kind = ByteStep::Kind::transfer});  // an empty transfer, in which nothing is received
  EXPECT_EQ(port.wait({}).kind, ByteEvent::Kind::sent);
  EXPECT_EQ(port.wait({.at = never, .answer = 1ms, .gap = 1h}).kind, ByteEvent::Kind::silence);
}

TEST_F(SpiPortTest, InterruptsEndEveryWait) {
  catch_interrupts();
  SpiPort port = open();
  ::raise(SIGINT);
  EXPECT_THROW(static_cast<void>(port.wait({.at = never})), Interrupted);
  ::raise(SIGINT);
  EXPECT_THROW(port.begin({.kind = ByteStep::Kind::transfer, .expect = 1}), Interrupted);
  port.begin({.kind = ByteStep::Kind::transfer, .expect = 1});
  ::raise(SIGINT);
  EXPECT_THROW(port.begin({.kind = ByteStep::Kind::transfer, .expect = 1, .at = os::now() + 1h}), Interrupted);
}

TEST_F(SpiPortTest, ReportsRefusedMode) {
  kernel.refusals[SPI_IOC_WR_MODE32] = EINVAL;
  EXPECT_EQ(refusal(Kind::unsupported),
            "the controller of /dev/spidev0.0 refused SPI mode 1 (Invalid argument): use another controller");
  EXPECT_EQ(refusal(Kind::unsupported, LinkKind::clocked, ssi_settings),
            "the controller of /dev/spidev0.0 refused SPI mode 3 (Invalid argument): swap the two wires of the clock "
            "pair and set spi_mode=1, or use another controller");
  kernel.refusals.clear();
  kernel.mode_mask = SPI_CPHA;  // the controller accepts SPI_CPOL, but ignores it
  EXPECT_THAT(refusal(Kind::unsupported, LinkKind::clocked, biss_settings), HasSubstr("refused SPI mode 3"));
}

TEST_F(SpiPortTest, ReportsRefusedWord) {
  kernel.refusals[SPI_IOC_WR_BITS_PER_WORD] = EINVAL;
  EXPECT_EQ(refusal(Kind::unsupported),
            "the controller of /dev/spidev0.0 refused words of 8 bits (Invalid argument): use another controller");
}

TEST_F(SpiPortTest, ReportsRefusedSpeed) {
  kernel.refusals[SPI_IOC_WR_MAX_SPEED_HZ] = EINVAL;
  EXPECT_EQ(refusal(Kind::bad_rate),
            "the controller of /dev/spidev0.0 refused a clock of 4000000 Hz (Invalid argument): try another one with "
            "speed=HZ");
  kernel.refusals.clear();
  kernel.highest_speed = 1'000'000;
  EXPECT_EQ(
      refusal(Kind::bad_rate),
      "the controller of /dev/spidev0.0 makes a clock of 1000000 Hz when asked for 4000000 Hz: set speed=1000000");
}

TEST_F(SpiPortTest, ReportsRefusedMessage) {
  SpiPort port = open();
  const auto failure = [&](int error) {
    kernel.refusals[SPI_IOC_MESSAGE(1)] = error;
    return failure_of([&] { port.begin({.kind = ByteStep::Kind::transfer, .expect = 5000}); });
  };
  EXPECT_EQ(failure(EMSGSIZE).what(),
            std::string("/dev/spidev0.0 refused a message of 5000 bytes at 4000000 Hz in mode 1 (Message too long): "
                        "load the module spidev with a larger bufsiz"));
  EXPECT_THAT(failure(EINVAL).what(), HasSubstr("(Invalid argument): try another speed=HZ"));
  EXPECT_EQ(failure(ESHUTDOWN).kind(), Kind::lost);
  EXPECT_EQ(failure(ENODEV).kind(), Kind::lost);
  EXPECT_EQ(failure(ENOTCONN).kind(), Kind::lost);
  EXPECT_EQ(failure(ECONNABORTED).kind(), Kind::lost);
  kernel.refusals.clear();
  kernel.missing = 1;
  EXPECT_THAT(failure_of([&] { port.begin({.kind = ByteStep::Kind::transfer, .expect = 2}); }).what(),
              HasSubstr("refused a message of 2 bytes"));
}

TEST_F(SpiPortTest, ReportsWhyItDoesNotOpen) {
  const auto failure = [&](const std::string& path) {
    return failure_of([&] { const SpiPort port(path, LinkKind::spi, encoder_settings, {}, kernel); });
  };
  EXPECT_EQ(failure("/dev/spidev9.9").kind(), Kind::not_found);
  EXPECT_THAT(failure("/dev/spidev9.9").what(), HasSubstr("there is no SPI device /dev/spidev9.9"));
  kernel.open_error = EACCES;
  EXPECT_EQ(refusal(Kind::no_permission).find("no permission to open /dev/spidev0.0"), 0u);
  kernel.open_error = 0;
  kernel.refusals[SPI_IOC_RD_MODE32] = ENOTTY;
  EXPECT_THAT(refusal(Kind::unsupported), HasSubstr("is not an SPI device: its name is /dev/spidevB.C"));
  kernel.refusals.clear();
  const SpiPort first = open();
  EXPECT_THAT(refusal(Kind::in_use), HasSubstr("in use"));
}

TEST(SpiPortOfTheSystem, OpensNoOtherFile) {
  const auto failure = [](const char* path) {
    return failure_of([&] { const SpiPort port(path, LinkKind::spi, encoder_settings); });
  };
  EXPECT_EQ(failure("/dev/spidev255.255").kind(), Kind::not_found);
  EXPECT_EQ(failure("/dev/null").kind(), Kind::unsupported);
  EXPECT_EQ(failure("/dev").kind(), Kind::unsupported);
}

TEST_F(SpiPortTest, HasNoOtherLinesAndNoOtherLinks) {
  SpiPort port = open();
  EXPECT_EQ(failure_of([&] { port.begin({.kind = ByteStep::Kind::pulse}); }).kind(), Kind::unsupported);
  EXPECT_THROW(open(LinkKind::half_duplex), std::invalid_argument);
}

TEST(SpiDevices, AreListed) {
  const TemporaryDirectory directory;
  for (const char* name : {"spidev1.0", "spidev0.1", "spidev0.0"}) std::ofstream(directory.path() / name);
  EXPECT_EQ(spi_devices(directory.path()),
            (std::vector<std::string>{"/dev/spidev0.0", "/dev/spidev0.1", "/dev/spidev1.0"}));
  EXPECT_TRUE(spi_devices(directory.path() / "none").empty());
}

}  // namespace
}  // namespace absenc::os
