// SPDX-License-Identifier: Apache-2.0
// Runs hosts of biss, ssi and an SPI protocol on an SPI port with a virtual encoder.
#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>

#include "absenc/host/drive.hpp"
#include "absenc/os/linux/fake_spi_test.hpp"
#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/biss/unit.hpp"
#include "absenc/protocol/encolink/device.hpp"
#include "absenc/protocol/encolink/host.hpp"
#include "absenc/protocol/ssi/device.hpp"
#include "absenc/protocol/ssi/host.hpp"
#include "absenc/sim/rough_line.hpp"
#include "absenc/sim/sim_port.hpp"
#include "tests/shape_toys.hpp"

namespace absenc::os {
namespace {

using namespace testing;

bool run(Machine<std::uint8_t>& host, SpiPort& port) {
  return host::drive(host, port, [] { return true; });
}

struct SpiEncoder : ::testing::Test {
  FakeSpi kernel;
  biss::testing::TestShaft shaft;
};

TEST_F(SpiEncoder, SsiOfEveryLength) {
  for (const std::uint8_t bits : std::initializer_list<std::uint8_t>{7, 8, 12, 13, 25}) {
    WordFormat word;
    word.add({"position", Meaning::position, bits});
    const ssi::Format format{.word = word};
    ssi::VirtualEncoder encoder(format, shaft);
    encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    FakeSpi controller;
    controller.connect(LinkKind::clocked, ssi::line_settings, encoder);
    SpiPort port(FakeSpi::path, LinkKind::clocked, ssi::line_settings, {}, controller);
    for (const std::int64_t position : std::initializer_list<std::int64_t>{0x95C6'1234, 0x3A59'8DE1, 0xFFFF'FFFE}) {
      shaft.state.position = position;
      ssi::ReadPosition read(format);
      ASSERT_TRUE(run(read, port));
      ASSERT_EQ(read.error(), Error::none) << bits;
      EXPECT_EQ(read.last(), word_of(format.word, shaft.state, 0)) << bits;
    }
    EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
  }
}

// The host clocks 1000 bits, more than the BiSS frame has.
TEST_F(SpiEncoder, SloIsLowBehindTheCrcOnEveryPort) {
  constexpr std::size_t clocks = 1000;
  const auto samples = [&](Port<std::uint8_t>& port) {
    port.begin({.kind = ByteStep::Kind::transfer, .bits = clocks, .at = port.now() + 1ms});
    ByteEvent event{};
    while (event.kind != ByteEvent::Kind::received) event = port.wait({.at = never});
    return Data(event.items.begin(), event.items.end());
  };
  const auto encoder_on = [&](auto& encoder) -> Machine<std::uint8_t>& {
    encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    return encoder;
  };
  shaft.state.position = 0x95C6'1234;
  biss::VirtualEncoder on_line({}, shaft), on_rough_line({}, shaft), on_controller({}, shaft);
  sim::SimPort<std::uint8_t> line(LinkKind::clocked, biss::line_settings, encoder_on(on_line));
  sim::RoughLine<std::uint8_t> rough_line(LinkKind::clocked, biss::line_settings, encoder_on(on_rough_line), 1);
  kernel.connect(LinkKind::clocked, biss::line_settings, encoder_on(on_controller));
  SpiPort controller(FakeSpi::path, LinkKind::clocked, biss::line_settings, {}, kernel);

  const Data expected = samples(line);
  ASSERT_EQ(expected.size(), clocks / 8);
  const auto behind = static_cast<std::size_t>((biss::clocks(biss::Format{}, 10us, 1us) + 7) / 8);
  EXPECT_EQ(Data(expected.begin() + behind, expected.end()), Data(expected.size() - behind, 0));
  EXPECT_EQ(samples(rough_line), expected);
  EXPECT_EQ(samples(controller), expected);
}

TEST_F(SpiEncoder, SsiReadTwice) {
  const WordFormat word = "position:13"_word;
  const ssi::Format format{.word = word, .extra_clocks = 13};
  ssi::VirtualEncoder encoder(format, shaft);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  kernel.connect(LinkKind::clocked, ssi::line_settings, encoder);
  SpiPort port(FakeSpi::path, LinkKind::clocked, ssi::line_settings, {}, kernel);
  shaft.state.position = 0x95C6'1234;
  ssi::ReadPosition read(format);
  ASSERT_TRUE(run(read, port));
  EXPECT_EQ(read.error(), Error::none);
  EXPECT_EQ(read.last(), word_of(format.word, shaft.state, 0));
}

TEST_F(SpiEncoder, Biss) {
  const biss::Format format{.word = "multiturn:16 position:19 error:1! warning:1!"_word};
  biss::VirtualEncoder encoder(format, shaft);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  kernel.connect(LinkKind::clocked, biss::line_settings, encoder);
  SpiPort port(FakeSpi::path, LinkKind::clocked, biss::line_settings, {}, kernel);
  for (const std::uint32_t rate : {200'000u, 1'000'000u, 4'000'000u}) {
    shaft.state.position += 0x1'8673'2468;
    biss::Format clocked = format;
    clocked.ma_khz = static_cast<std::uint16_t>(rate / 1000);
    biss::ReadPosition read(clocked);
    ASSERT_TRUE(run(read, port));
    ASSERT_EQ(read.error(), Error::none) << rate;
    EXPECT_EQ(read.last().word, word_of(format.word, shaft.state, 0)) << rate;
    EXPECT_EQ(kernel.settings().speed, rate);
  }
  EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
}

/// A virtual BiSS encoder with registers behind a simulated SPI controller, and a host that reads the registers.
struct BissRegisters {
  BissRegisters(FakeSpi& kernel, const Shaft& shaft) : encoder(biss::Format{}, shaft) {
    EXPECT_EQ(resolve_options(biss::unit, {}, {}, options).kind, OptionError::Kind::none);
    encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    kernel.connect(LinkKind::clocked, biss::line_settings, encoder);
  }
  Conversation<std::uint8_t>& info() {
    return *biss::unit.host(options, *find_command(biss::unit, Verb::info), {}, storage).bytes;
  }

  Options options;
  biss::VirtualEncoder encoder;
  std::vector<std::byte> storage = std::vector<std::byte>(biss::unit.host_storage);
};

TEST_F(SpiEncoder, ReadsRegistersWithClockLevel) {
  BissRegisters registers(kernel, shaft);
  SpiPort port(FakeSpi::path, LinkKind::clocked, biss::line_settings, {}, kernel);
  Conversation<std::uint8_t>& info = registers.info();
  ASSERT_TRUE(run(info, port));
  EXPECT_EQ(info.error(), Error::none);
}

// An SPI controller sends the two pulses of the BiSS start sequence as one byte.
TEST_F(SpiEncoder, BissIsStartedByAByteOfPulses) {
  biss::Format format;
  format.start_sequence = true;
  biss::VirtualEncoder encoder(format, shaft);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  kernel.connect(LinkKind::clocked, biss::line_settings, encoder);
  SpiPort port(FakeSpi::path, LinkKind::clocked, biss::line_settings, {}, kernel);
  biss::FindPosition<biss::Format> read(format);
  ASSERT_TRUE(run(read, port));
  EXPECT_EQ(read.error(), Error::none);
  EXPECT_EQ(encoder.violation_count(), 0u);
}

TEST_F(SpiEncoder, AControllerThatOnlyIdlesHighReadsNoRegisters) {
  BissRegisters registers(kernel, shaft);
  SpiPort port(FakeSpi::path, LinkKind::clocked, biss::line_settings, {}, kernel);
  kernel.refusals[SPI_IOC_WR_MODE32] = EINVAL;
  biss::ReadPosition read(biss::Format{});
  ASSERT_TRUE(run(read, port));
  EXPECT_EQ(read.error(), Error::none);
  try {
    static_cast<void>(run(registers.info(), port));
    ADD_FAILURE() << "it was read";
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.kind(), Failure::Kind::unsupported);
    EXPECT_NE(std::string(failure.what()).find("use one with SPI modes 1 and 3"), std::string::npos) << failure.what();
  }
}

TEST_F(SpiEncoder, Encolink) {
  const encolink::Format format{.resolution = 20, .multiturn_bits = 16, .interface = encolink::Interface::spi};
  const auto read = [&](encolink::VirtualEncoder& encoder, const SpiChoice& choice) {
    FakeSpi controller;
    encoder.power_on(os::now(), Device<std::uint8_t>::PowerOn::skip);
    controller.connect(LinkKind::spi, encolink::spi_settings, encoder);
    SpiPort port(FakeSpi::path, LinkKind::spi, encolink::spi_settings, choice, controller);
    encolink::ReadPosition conversation(format);
    EXPECT_TRUE(run(conversation, port));
    if (conversation.error() == Error::none) {
      EXPECT_EQ(conversation.reading()->singleturn, encoder.measure({}).singleturn);
      EXPECT_EQ(conversation.reading()->multiturn, encoder.measure({}).multiturn);
    }
    return conversation.error();
  };
  shaft.state.position = 0x7'95C6'1234;
  encolink::VirtualEncoder good(format, shaft);
  EXPECT_EQ(read(good, {4'000'000, {}}), Error::none);
  EXPECT_EQ(good.violation_count(), 0u) << good.violations()[0].rule;
  for (const std::uint8_t mode : {std::uint8_t{0}, std::uint8_t{2}, std::uint8_t{3}}) {
    encolink::VirtualEncoder shifted(format, shaft);
    EXPECT_EQ(read(shifted, {{}, mode}), Error::bad_checksum) << int{mode};
  }
  // The time between chip select and the first clock does not lower the measured clock rate.
  encolink::VirtualEncoder hurried(format, shaft);
  EXPECT_EQ(read(hurried, {4'100'000, {}}), Error::none);
  ASSERT_GT(hurried.violation_count(), 0u);
  EXPECT_EQ(hurried.violations()[0].rule, "clock faster than 4 MHz");
}

TEST_F(SpiEncoder, EncolinkNoticesAClockTooSoonAfterChipSelect) {
  encolink::Format format = encolink::virtual_format;
  format.interface = encolink::Interface::spi;
  for (const Time lead : {Time{}, Time{4000}, Time{5000}}) {
    encolink::VirtualEncoder encoder(format, shaft);
    encoder.power_on(os::now(), Device<std::uint8_t>::PowerOn::skip);
    LineSettings settings = encolink::spi_settings;
    settings.select_lead = lead;
    FakeSpi controller;
    controller.connect(LinkKind::spi, settings, encoder);
    SpiPort port(FakeSpi::path, LinkKind::spi, settings, {}, controller);
    encolink::ReadPosition conversation(format);
    ASSERT_TRUE(run(conversation, port));
    if (lead == encolink::spi_lead) {
      EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
    } else {
      ASSERT_GT(encoder.violation_count(), 0u);
      EXPECT_EQ(encoder.violations()[0].rule, "clock less than 5 us after NCS went low");
    }
  }
}

TEST_F(SpiEncoder, ReportsMissingEncoder) {
  SpiPort port(FakeSpi::path, LinkKind::clocked, biss::line_settings, {}, kernel);
  biss::ReadPosition read({});
  ASSERT_TRUE(run(read, port));
  EXPECT_EQ(read.error(), Error::line_stuck);
}

TEST_F(SpiEncoder, BytesBothWays) {
  toy::Toy<std::uint8_t> device([](auto& self, const ByteEvent& event) {
    if (event.kind == ByteEvent::Kind::selected) self.send({0xA1, 0xB2, 0xC3});
  });
  kernel.connect(LinkKind::spi, {.rate = 1'000'000, .spi_mode = 1}, device);
  SpiPort port(FakeSpi::path, LinkKind::spi, {.rate = 1'000'000, .spi_mode = 1}, {}, kernel);
  Data received_bytes;
  toy::Toy<std::uint8_t> host([&](auto& self, const ByteEvent& event) {
    if (event.kind != ByteEvent::Kind::received) return;
    received_bytes = data(event.items);
    self.finish();
  });
  host.idle.at = never;
  host.send({0x11, 0x22}, {}, 0, 4);
  ASSERT_TRUE(run(host, port));
  EXPECT_EQ(received_bytes, (Data{0xA1, 0xB2, 0xC3, 0xFF}));
  EXPECT_NE(device.log.find("received 11 22 00 00"), std::string::npos) << device.log;
}

}  // namespace
}  // namespace absenc::os
