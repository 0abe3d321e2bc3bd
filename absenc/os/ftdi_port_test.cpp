// SPDX-License-Identifier: Apache-2.0
// Runs hosts of biss and ssi on a port of an FTDI chip: an MPSSE of test code, with virtual encoders on its pins.
#include "absenc/os/ftdi_port.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <sstream>

#include "absenc/host/drive.hpp"
#include "absenc/os/fake_ftdi_test.hpp"
#include "absenc/os/testing.hpp"
#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/biss/unit.hpp"
#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/endat/device.hpp"
#include "absenc/protocol/endat/unit.hpp"
#include "absenc/protocol/ssi/device.hpp"
#include "absenc/protocol/ssi/host.hpp"
#include "tests/shape_toys.hpp"

namespace absenc::os {
namespace {

using namespace testing;
using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr auto skip = Device<std::uint8_t>::PowerOn::skip;

bool run(Machine<std::uint8_t>& host, FtdiPort& port) {
  return host::drive(host, port, [] { return true; });
}

struct Nobody final : ftdi::Wires {
  void change(Time, std::uint8_t, std::uint8_t) override {}
  bool data(Time) override { return true; }
};

struct FtdiEncoder : ::testing::Test {
  biss::testing::TestShaft shaft;
};

TEST(Mpsse, NearestClockIsWhatTheDividerCanDo) {
  const auto rate = [](std::uint32_t wanted, std::uint32_t base = 60'000'000, std::uint32_t limit = 0) {
    const std::optional<MpsseClock> clock = MpsseClock::nearest(wanted, base, limit);
    return clock ? clock->rate() : 0;
  };
  EXPECT_EQ(rate(70'000), 69'930u);
  EXPECT_EQ(rate(1'000'000), 1'000'000u);
  EXPECT_EQ(rate(5'000'000), 5'000'000u);
  EXPECT_EQ(rate(10'000'000), 10'000'000u);
  EXPECT_EQ(rate(30'000'000), 30'000'000u);
  EXPECT_EQ(rate(30'000'001), 0u);
  EXPECT_EQ(rate(458), 458u);
  EXPECT_EQ(rate(457), 0u);
  EXPECT_EQ(rate(4'000'000), 3'750'000u);
  EXPECT_EQ(rate(7'000'000), 7'500'000u);
  EXPECT_EQ(rate(7'000'000, 60'000'000, 7'000'000), 6'000'000u);
  EXPECT_EQ(rate(6'000'000, 12'000'000), 6'000'000u);
  EXPECT_EQ(rate(6'000'001, 12'000'000), 0u);
}

TEST_F(FtdiEncoder, SsiOfEveryLength) {
  for (const std::uint8_t bits : std::initializer_list<std::uint8_t>{7, 8, 12, 13, 25}) {
    WordFormat word;
    word.add({"position", Meaning::position, bits});
    const ssi::Format format{.word = word};
    ssi::VirtualEncoder encoder(format, shaft);
    encoder.power_on(Time{}, skip);
    ftdi::EncoderWires wires(LinkKind::clocked, ssi::line_settings, encoder);
    FakeFtdi usb(wires);
    FtdiPort port("", LinkKind::clocked, ssi::line_settings, {}, usb);
    for (const std::int64_t position : std::initializer_list<std::int64_t>{0x95C6'1234, 0x3A59'8DE1, 0xFFFF'FFFE}) {
      shaft.state.position = position;
      ssi::ReadPosition read(format);
      ASSERT_TRUE(run(read, port));
      ASSERT_EQ(read.error(), Error::none) << bits;
      EXPECT_EQ(read.last(), word_of(format.word, shaft.state, 0)) << bits;
    }
    EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
    EXPECT_EQ(usb.mpsse.misused(), 0u);
  }
}

TEST_F(FtdiEncoder, BissAtEveryClock) {
  const biss::Format format{.word = "multiturn:16 position:19 error:1! warning:1!"_word};
  biss::VirtualEncoder encoder(format, shaft);
  encoder.power_on(Time{}, skip);
  ftdi::EncoderWires wires(LinkKind::clocked, biss::line_settings, encoder);
  FakeFtdi usb(wires);
  FtdiPort port("", LinkKind::clocked, biss::line_settings, {}, usb);
  for (const std::uint32_t rate : {70'000u, 1'000'000u, 5'000'000u, 10'000'000u}) {
    shaft.state.position += 0x1'8673'2468;
    biss::Format clocked = format;
    clocked.ma_khz = static_cast<std::uint16_t>(rate / 1000);
    biss::ReadPosition read(clocked);
    ASSERT_TRUE(run(read, port));
    ASSERT_EQ(read.error(), Error::none) << rate;
    EXPECT_EQ(read.last().word, word_of(format.word, shaft.state, 0)) << rate;
    EXPECT_NEAR(usb.mpsse.rate(), rate, rate * 0.002);
    EXPECT_NEAR(port.settings().rate, usb.mpsse.rate(), 1);
  }
  EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
  EXPECT_EQ(usb.mpsse.misused(), 0u);
}

TEST_F(FtdiEncoder, AReadingIsOneUsbTransfer) {
  const biss::Format format;
  biss::VirtualEncoder encoder(format, shaft);
  encoder.power_on(Time{}, skip);
  ftdi::EncoderWires wires(LinkKind::clocked, biss::line_settings, encoder);
  FakeFtdi usb(wires);
  FtdiPort port("", LinkKind::clocked, biss::line_settings, {}, usb);
  const unsigned before = usb.writes;
  for (int i = 0; i < 10; ++i) {
    port.begin({.kind = ByteStep::Kind::configure, .rate = i % 2 == 0 ? 2'000'000u : 1'000'000u});
    biss::ReadPosition read(format);
    ASSERT_TRUE(run(read, port));
    ASSERT_EQ(read.error(), Error::none);
  }
  EXPECT_EQ(usb.writes - before, 10u);
}

TEST_F(FtdiEncoder, ReadsRegistersByTheLevelOfTheClockInTheTimeout) {
  Options options;
  ASSERT_EQ(resolve_options(biss::unit, {}, {}, options).kind, OptionError::Kind::none);
  biss::VirtualEncoder encoder(biss::Format{}, shaft);
  encoder.power_on(Time{}, skip);
  ftdi::EncoderWires wires(LinkKind::clocked, biss::line_settings, encoder);
  FakeFtdi usb(wires);
  FtdiPort port("", LinkKind::clocked, biss::line_settings, {}, usb);
  std::vector<std::byte> storage(biss::unit.host_storage);
  Conversation<std::uint8_t>& info =
      *biss::unit.host(options, *find_command(biss::unit, Verb::info), {}, storage).bytes;
  ASSERT_TRUE(run(info, port));
  EXPECT_EQ(info.error(), Error::none);
  EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
}

TEST_F(FtdiEncoder, LineDelayShiftsBissByClocksOnly) {
  biss::Format format;
  format.ma_khz = 5000;
  biss::VirtualEncoder encoder(format, shaft);
  encoder.power_on(Time{}, skip);
  ftdi::EncoderWires wires(LinkKind::clocked, biss::line_settings, encoder);
  FakeFtdi usb(wires);
  FtdiPort port("", LinkKind::clocked, biss::line_settings, {}, usb);
  shaft.state.position = 0x95C6'1234;
  for (const Time delay : {0ns, 90ns, 150ns, 550ns}) {
    wires.fault.delay = delay;
    biss::FindPosition<biss::Format> read(format);
    ASSERT_TRUE(run(read, port));
    ASSERT_EQ(read.error(), Error::none) << delay.count();
    EXPECT_EQ(read.last().word, word_of(format.word, shaft.state, 0)) << delay.count();
  }
}

TEST_F(FtdiEncoder, StuckLinesAndAMissingTransceiver) {
  biss::VirtualEncoder encoder({}, shaft);
  encoder.power_on(Time{}, skip);
  ftdi::EncoderWires wires(LinkKind::clocked, biss::line_settings, encoder);
  FakeFtdi usb(wires);
  FtdiPort port("", LinkKind::clocked, biss::line_settings, {}, usb);
  const auto error = [&] {
    biss::ReadPosition read(biss::Format{});
    EXPECT_TRUE(run(read, port));
    return read.error();
  };
  EXPECT_EQ(error(), Error::none);
  EXPECT_TRUE(port.look_at_data().driven);
  for (const bool level : {false, true}) {
    wires.fault = {.stuck = level};
    EXPECT_EQ(error(), Error::line_stuck);
    const FtdiPort::DataPin pin = port.look_at_data();
    EXPECT_EQ(pin.high, level);
    EXPECT_TRUE(pin.driven);
  }
  wires.fault = {.no_transceiver = true};
  EXPECT_EQ(error(), Error::line_stuck);
  const FtdiPort::DataPin pin = port.look_at_data();
  EXPECT_TRUE(pin.high);
  EXPECT_FALSE(pin.driven);
}

// ---- A line that turns

struct FtdiBothWays : ::testing::Test {
  static constexpr LineSettings settings{.rate = 1'000'000, .spi_mode = 3};
  toy::Toy<std::uint8_t> device{[](auto& self, const ByteEvent& event) {
    if (event.kind == ByteEvent::Kind::received) {
      self.send({event.items[0] == 0x2D ? std::uint8_t{0x91} : std::uint8_t{0x0F}, 0xA4});
    }
  }};
  ftdi::EncoderWires wires{LinkKind::clocked_bidirectional, settings, (device.idle.at = never, device)};
  FakeFtdi usb{wires};

  // Runs exchanges, each of `out` bits and `in` bits, and returns what was received.
  struct Exchange {
    Data out;
    std::size_t out_bits, bits;
    bool goes_on = false;
  };
  std::string received(const std::vector<Exchange>& all) {
    FtdiPort port("", LinkKind::clocked_bidirectional, settings, {}, usb);
    std::string text;
    for (const Exchange& one : all) {
      port.begin({.kind = ByteStep::Kind::transfer,
                  .goes_on = one.goes_on,
                  .out = one.out,
                  .bits = one.bits,
                  .out_bits = one.out_bits});
      if (port.wait({}).kind != ByteEvent::Kind::sent) text += "no sent ";
      if (one.bits == one.out_bits) continue;
      const ByteEvent event = port.wait({});
      for (const std::uint8_t byte : event.items) text += toy::text_of(byte) + ' ';
      text += std::to_string(event.bits) + ", ";
    }
    wires.pass(os::now() + 1s);
    return text;
  }
  // The log of the device without its times.
  [[nodiscard]] std::string events() const {
    std::string text;
    std::istringstream words(device.log);
    for (std::string word; words >> word;) {
      if (word.size() > 7 && word.find_first_not_of("0123456789") == std::string::npos) continue;
      text += (text.empty() ? "" : " ") + word;
    }
    return text;
  }
};

TEST_F(FtdiBothWays, EncoderSendsInTheClocksThatTheHostLeaves) {
  EXPECT_EQ(received({{{0x2D}, 8, 20}}), "91 A0 12, ");
  EXPECT_THAT(events(), HasSubstr("received 2D 8, sent 20"));
  EXPECT_EQ(usb.mpsse.misused(), 0u);
}

TEST_F(FtdiBothWays, AnyNumberOfBits) {
  EXPECT_EQ(received({{{0x2D}, 8, 9}}), "80 1, ");
  EXPECT_EQ(received({{{0x2D}, 8, 10}}), "80 2, ");
  EXPECT_EQ(received({{{0x2D}, 8, 26}}), "91 A4 C0 18, ");
  EXPECT_EQ(received({{{0x28}, 5, 13}}), "0F 8, ");
  EXPECT_THAT(events(), HasSubstr("received 28 5, sent 13"));
  device.log.clear();
  EXPECT_EQ(received({{{0xA5, 0x80}, 9, 9}}), "");
  EXPECT_THAT(events(), HasSubstr("received A5 80 9, sent 9"));
  EXPECT_EQ(usb.mpsse.misused(), 0u);
}

TEST_F(FtdiBothWays, ExchangeGoesOnWhileClockRestsLow) {
  EXPECT_EQ(received({{{0x2D}, 8, 12, true}, {{}, 0, 4, true}, {{0xC0}, 3, 7}}), "90 4, 10 4, 00 4, ");
  EXPECT_THAT(events(), HasSubstr("received 2D 8,"));
  EXPECT_THAT(events(), HasSubstr("received C0 3, sent 23"));
  EXPECT_EQ(usb.mpsse.misused(), 0u);
}

TEST_F(FtdiBothWays, ExchangeMayGoOnBehindBitsOfTheHost) {
  EXPECT_EQ(received({{{0x2D}, 8, 8, true}, {{}, 0, 12}}), "91 A0 12, ");
  EXPECT_THAT(events(), HasSubstr("received 2D 8, sent 20"));
}

// Commands of EnDat with an encoder behind a long line: the port says how late it samples.
TEST_F(FtdiEncoder, LineDelayOfEndatIsThatOfTheLine) {
  endat::VirtualEncoder encoder({.singleturn_bits = 25}, shaft);
  encoder.power_on(Time{}, skip);
  constexpr LineSettings settings{.rate = 1'000'000, .spi_mode = 3};
  ftdi::EncoderWires wires(LinkKind::clocked_bidirectional, settings, encoder);
  FakeFtdi usb(wires);
  FtdiPort port("", LinkKind::clocked_bidirectional, settings, {}, usb);
  const Options options = author::testing::options_of(endat::unit, "singleturn_bits=25 clock_khz=2000 latency_us=5");
  for (const int delay : {700, 1200}) {
    wires.fault.delay = Time(delay);
    const author::testing::Talk<std::uint8_t> talk(endat::unit, options, "line-delay");
    ASSERT_TRUE(run(*talk, port));
    author::testing::RunResult result;
    result.take(*talk);
    ASSERT_EQ(result.error, Error::none) << result.detail;
    // The divider makes periods in steps of 33 ns.
    EXPECT_NEAR(static_cast<double>(result.numbers.at("line_delay_ns")), delay, 34);
  }
}

// EnDat's encoders need up to 0.2 us, and a cable adds 10 ns for each metre both ways.
TEST_F(FtdiBothWays, DelayUpToAPeriodAtTheGreatestClock) {
  constexpr LineSettings fastest{.rate = highest_turning_rate, .spi_mode = 3};
  for (const Time delay : {0ns, 200ns, 450ns}) {
    wires.fault.delay = delay;
    FtdiPort port("", LinkKind::clocked_bidirectional, fastest, {}, usb);
    const Data out{0x2D};
    port.begin({.kind = ByteStep::Kind::transfer, .out = out, .bits = 24, .out_bits = 8});
    static_cast<void>(port.wait({}));
    EXPECT_EQ(data(port.wait({}).items), (Data{0x91, 0xA4})) << delay.count();
    wires.pass(os::now() + 1s);
  }
  const Failure failure = failure_of([&] {
    FtdiPort("", LinkKind::clocked_bidirectional, {.rate = highest_turning_rate + 1, .spi_mode = 3}, {}, usb);
  });
  EXPECT_EQ(failure.kind(), Failure::Kind::bad_rate);
  EXPECT_THAT(failure.what(), HasSubstr("set speed=2000000"));
}

// ---- SPI

TEST(FtdiPort, ExchangesBytesInModes0And2) {
  struct Loop final : ftdi::Wires {
    void change(Time, std::uint8_t levels, std::uint8_t) override {
      out = (levels & ftdi::Mpsse::out) != 0;
      selected = (levels & ftdi::Mpsse::tms) == 0;
    }
    bool data(Time) override { return out && selected; }
    bool out = false, selected = false;
  } loop;
  FakeFtdi usb(loop);
  for (const std::uint8_t mode : {std::uint8_t{0}, std::uint8_t{2}}) {
    FtdiPort port("", LinkKind::spi, {.rate = 1'000'000, .spi_mode = mode, .select_lead = 5us}, {}, usb);
    EXPECT_EQ(usb.mpsse.levels() & ftdi::Mpsse::clock, mode == 2 ? 1 : 0);
    const Data out{0x12, 0xA5, 0xFE};
    port.begin({.kind = ByteStep::Kind::transfer, .out = out, .expect = 4});
    static_cast<void>(port.wait({}));
    EXPECT_EQ(data(port.wait({}).items), (Data{0x12, 0xA5, 0xFE, 0x00}));
    EXPECT_FALSE(loop.selected);
  }
  EXPECT_EQ(usb.mpsse.misused(), 0u);
  const Failure failure = failure_of([&] { FtdiPort("", LinkKind::spi, encolink::spi_settings, {}, usb); });
  EXPECT_EQ(failure.kind(), Failure::Kind::unsupported);
  EXPECT_THAT(failure.what(), HasSubstr("shifts in SPI modes 0 and 2 (FTDI's AN 114), but this encoder needs mode 1"));
}

// ---- Errors in words

struct FtdiErrors : ::testing::Test {
  Nobody nobody;
  FakeFtdi usb{nobody};
  Failure open(const std::string& place, std::uint32_t rate = 1'000'000) {
    return failure_of([&] { FtdiPort(place, LinkKind::clocked, {.rate = rate, .spi_mode = 3}, {}, usb); });
  }
};

TEST_F(FtdiErrors, SayWhichAdaptersThereAre) {
  usb.plugged.clear();
  EXPECT_EQ(open("").kind(), Failure::Kind::not_found);
  EXPECT_THAT(open("").what(), HasSubstr("no FTDI chip with an MPSSE on USB, nor any other"));
  usb.plugged = {ftdi_chip(0x6001, 0x0600, "A50285BI")};
  EXPECT_THAT(open("").what(), HasSubstr("this computer has FT232R (serial number A50285BI), which has no MPSSE"));
  EXPECT_EQ(open("A50285BI").kind(), Failure::Kind::unsupported);
  EXPECT_THAT(open("A50285BI").what(), HasSubstr("has no MPSSE, so it cannot clock an encoder"));
  usb.plugged.push_back(ftdi_chip(0x6015, 0x1000, "DN0000"));
  EXPECT_THAT(open("DN0000").what(), HasSubstr("FT231X (serial number DN0000) has no MPSSE"));
  usb.plugged.push_back(ftdi_chip(0x6014, 0x0900, "FT1"));
  EXPECT_EQ(open("FT2").kind(), Failure::Kind::not_found);
  EXPECT_THAT(open("FT2").what(), HasSubstr("no FTDI chip with the serial number FT2: this computer has FT232R"));
  usb.plugged.push_back(ftdi_chip(0x6010, 0x0700, "FT2"));
  EXPECT_THAT(open("").what(),
              HasSubstr("more than one FTDI chip is plugged in: say which by its serial number, as in "
                        "ftdi:FT1; there are FT232H (serial number FT1), FT2232H (serial number FT2)"));
}

TEST_F(FtdiErrors, Channels) {
  usb.plugged = {ftdi_chip(0x6014, 0x0900, "FT1")};
  EXPECT_THAT(open("FT1/B").what(),
              HasSubstr("channel B of the FT232H (serial number FT1) has no MPSSE: use channel A"));
  EXPECT_THAT(open("FT1/E").what(), HasSubstr("\"E\" is no channel of an FTDI chip: write A or B"));
  usb.plugged = {ftdi_chip(0x6011, 0x0800, "FT4")};
  EXPECT_THAT(open("/C").what(), HasSubstr("has no MPSSE: use channel A or B"));
  const FtdiPort port("/B", LinkKind::clocked, {.rate = 1'000'000, .spi_mode = 3}, {}, usb);
  EXPECT_EQ(usb.opened, "FT4232H (serial number FT4)/B");
  EXPECT_EQ(port.name(), "FT4232H (serial number FT4), channel B");
}

TEST_F(FtdiErrors, AClockThatTheDividerCannotDo) {
  EXPECT_EQ(open("", 40'000'000).kind(), Failure::Kind::bad_rate);
  EXPECT_THAT(open("", 40'000'000).what(), HasSubstr("makes 458 Hz to 30000000 Hz, not 40000000 Hz"));
  EXPECT_THAT(open("", 100).what(), HasSubstr("not 100 Hz: set another speed=HZ"));
}

TEST_F(FtdiErrors, AChipThatDoesNotAnswer) {
  usb.is_deaf = true;
  EXPECT_EQ(open("").kind(), Failure::Kind::unsupported);
  EXPECT_THAT(open("").what(), HasSubstr("the MPSSE of the FT232H (serial number FT1ABC) does not answer"));
}

TEST_F(FtdiErrors, UnpluggedWhileItReads) {
  FtdiPort port("", LinkKind::clocked, {.rate = 1'000'000, .spi_mode = 3}, {}, usb);
  usb.is_unplugged = true;
  EXPECT_EQ(failure_of([&] { port.begin({.kind = ByteStep::Kind::transfer, .bits = 8}); }).kind(), Failure::Kind::lost);
}

TEST_F(FtdiErrors, RepliesOfAnEarlierProgramAreDropped) {
  usb.stale = {0xFA, 0xAA, 0x12, 0xFA};
  FtdiPort port("", LinkKind::clocked, {.rate = 1'000'000, .spi_mode = 3}, {}, usb);
  port.begin({.kind = ByteStep::Kind::transfer, .bits = 12});
  static_cast<void>(port.wait({}));
  EXPECT_EQ(data(port.wait({}).items), (Data{0xFF, 0xF0}));
}

}  // namespace
}  // namespace absenc::os
