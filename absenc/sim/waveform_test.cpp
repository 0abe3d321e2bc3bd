// SPDX-License-Identifier: Apache-2.0
// Tests waveforms as text, and with the decoders of sigrok-cli as independent readers.
#include "absenc/sim/waveform.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>
#include <stdio.h>
#include <stdlib.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "absenc/capture/annotate/drawing.hpp"
#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/ssi/device.hpp"
#include "absenc/protocol/ssi/host.hpp"
#include "absenc/protocol/tformat/bench_test.hpp"
#include "absenc/sim/can_bits.hpp"
#include "tests/shape_toys.hpp"

namespace absenc::sim {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr LineSettings slow{.rate = 1'000'000};

struct Canvas {
  capture::Drawing drawing{"test"};
  capture::WaveformSink<Waveform> sink{drawing};
};

struct Picture : Canvas, Waveform {
  Picture(LinkKind kind, const LineSettings& settings) : Waveform(kind, settings, sink) {}

  const std::string& vcd() {
    if (!text.empty()) return text;
    sink.finish(*this, 10us);
    std::ostringstream out;
    capture::write_vcd(out, drawing);
    return text = out.str();
  }
  std::string text;
};

std::string body(Picture& picture) {
  const std::string text = picture.vcd();
  const std::size_t end = text.find("$enddefinitions $end\n");
  EXPECT_NE(end, std::string::npos);
  return text.substr(end + 21);
}

TEST(Waveform, NamesItsWires) {
  EXPECT_THAT(Picture(LinkKind::spi, slow).vcd(),
              ::testing::StartsWith("$version absenc $end\n$timescale 1 ns $end\n$scope module test $end\n"
                                    "$var wire 1 ! cs $end\n$var wire 1 \" sck $end\n$var wire 1 # mosi $end\n"
                                    "$var wire 1 $ miso $end\n$upscope $end\n$enddefinitions $end\n#0\n"
                                    "1!\n0\"\n0#\n1$\n"));
  EXPECT_THAT(Picture(LinkKind::full_duplex, slow).vcd(), HasSubstr("! host $end\n$var wire 1 \" device $end\n"));
  EXPECT_THAT(Picture(LinkKind::can, slow).vcd(), HasSubstr("! can $end\n"));
}

TEST(Waveform, DrawsCharactersOfFiveToSixteenDataBits) {
  for (unsigned data_bits = 5; data_bits <= 16; ++data_bits) {
    LineSettings settings = slow;
    settings.data_bits = static_cast<std::uint8_t>(data_bits);
    settings.parity = Parity::odd;
    Picture picture(LinkKind::half_duplex, settings);
    // The line is low in the start bit, in the highest data bit, and in a parity bit of 0.
    const unsigned value = (1u << (data_bits - 1)) - 1;
    picture.character(NodeRole::host, 0us, settings.character(), static_cast<std::uint16_t>(value));
    const bool parity = data_bits % 2 != 0;  // odd parity: the parity bit is 1 if the data have an even number of ones
    const unsigned end = data_bits + (parity ? 1 : 2);
    EXPECT_EQ(body(picture).find("#" + std::to_string(1000 * data_bits) + "\n0!\n#" + std::to_string(1000 * end) +
                                 "\n1!\n") != std::string::npos,
              true)
        << body(picture);
  }
}

// Two bytes share a character of 16 bits; if the second byte is missing, ones are drawn in its place.
TEST(Waveform, DrawsTwoBytesAsOneCharacterOfSixteenBits) {
  LineSettings settings = slow;
  settings.data_bits = 16;
  struct Once final : Machine<std::uint8_t> {
    void feed(const ByteEvent&) override {}
    ByteStep next(Time) override {
      if (std::exchange(sent, true)) return {.at = never};
      return {.kind = ByteStep::Kind::transfer, .out = bytes, .at = 10us};
    }
    std::array<std::uint8_t, 3> bytes{0x34, 0x12, 0x7F};
    bool sent = false;
  } host;
  Picture picture(LinkKind::half_duplex, settings);
  Line<std::uint8_t> line(LinkKind::half_duplex, settings);
  picture.observe(line);
  line.attach(NodeRole::host, host);
  line.run_until(1ms);
  EXPECT_THAT(picture.vcd(), HasSubstr("#10000 host 34 12 $end\n$comment #28000 host 7F FF $end"));
}

TEST(Waveform, CommentsListTheItems) {
  Picture waveform(LinkKind::full_duplex, slow);
  waveform.character(NodeRole::device, 7us, 17us, 0x00);
  waveform.character(NodeRole::host, 5us, 15us, 0x1A);
  EXPECT_THAT(waveform.vcd(), HasSubstr("$timescale 1 ns $end\n$comment #5000 host 1A $end\n"
                                        "$comment #7000 device 00 $end\n$scope"));
  Picture spi(LinkKind::spi, slow);
  const std::array<std::uint8_t, 2> out{0x12, 0x34};
  const std::array<std::uint8_t, 2> in{0xAB, 0xCD};
  spi.transfer({0us, 16us, 16, out, in});
  EXPECT_THAT(spi.vcd(), HasSubstr("$comment #0 mosi 12 34 miso AB CD $end\n"));
  Picture clocked(LinkKind::clocked, slow);
  clocked.transfer({0us, 12us, 12, {}, in});
  EXPECT_THAT(clocked.vcd(), HasSubstr("$comment #0 12 bits AB CD $end\n"));
}

TEST(Waveform, Character) {
  Picture waveform(LinkKind::half_duplex, slow);
  waveform.character(NodeRole::host, 5us, 15us, 0x1A);  // bits on the line: start bit 0, data bits 01011000, stop bit 1
  EXPECT_EQ(body(waveform),
            "#0\n1!\n#5000\n0!\n#7000\n1!\n#8000\n0!\n#9000\n1!\n#11000\n0!\n#14000\n1!\n"
            "#25000\n");
}

TEST(Waveform, ParityAndTwoStopBits) {
  for (const auto& [parity, high] : {std::pair{Parity::even, true}, std::pair{Parity::odd, false}}) {
    Picture waveform(LinkKind::full_duplex, {.rate = 1'000'000, .parity = parity, .stop_bits = 2});
    // bits on the line: start bit 0, data bits 00000001, parity bit, stop bits 11
    waveform.character(NodeRole::device, 0us, 12us, 0x80);
    EXPECT_THAT(body(waveform), HasSubstr(high ? "#8000\n1\"\n#22000\n" : "#8000\n1\"\n#9000\n0\"\n#10000\n1\"\n"));
  }
}

TEST(Waveform, CollisionIsTheAnd) {
  Picture waveform(LinkKind::half_duplex, slow);
  waveform.character(NodeRole::device, 0us, 10us, 0xFE);
  waveform.character(NodeRole::device, 1us, 11us, 0xFE);
  EXPECT_EQ(body(waveform), "#0\n0!\n#3000\n1!\n#21000\n");
}

TEST(Waveform, BitsThatAreNoWholeNanoseconds) {
  Picture waveform(LinkKind::half_duplex, {.rate = 3'000'000});
  waveform.character(NodeRole::host, 0ns, 3333ns, 0x55);  // the line changes its level at every bit of this character
  std::string edges;
  for (const int edge : {333, 667, 1000, 1333, 1667, 2000, 2333, 2666, 3000}) {
    edges += "#" + std::to_string(edge) + '\n';
    EXPECT_THAT(body(waveform), HasSubstr(edges.substr(edges.rfind('#'))));
  }
}

TEST(Waveform, SpiDataChangesAtTheEdgeOfTheMode) {
  const std::array<std::uint8_t, 1> out{0x80};
  const std::array<std::uint8_t, 1> in{0x7F};
  const auto drawn = [&](std::uint8_t mode) {
    Picture waveform(LinkKind::spi, {.rate = 1'000'000, .spi_mode = mode});
    waveform.transfer({1us, 9us, 8, out, in});
    return body(waveform);
  };
  using ::testing::EndsWith;
  using ::testing::StartsWith;
  EXPECT_THAT(drawn(0),
              StartsWith("#0\n1!\n0\"\n0#\n1$\n#1000\n0!\n1#\n0$\n#1500\n1\"\n#2000\n0\"\n0#\n1$\n#2500\n1\"\n"));
  EXPECT_THAT(drawn(0), EndsWith("#8500\n1\"\n#9000\n1!\n0\"\n#19000\n"));
  EXPECT_THAT(drawn(1),
              StartsWith("#0\n1!\n0\"\n0#\n1$\n#1000\n0!\n1\"\n1#\n0$\n#1500\n0\"\n#2000\n1\"\n0#\n1$\n#2500\n0\"\n"));
  EXPECT_THAT(drawn(1), EndsWith("#8500\n0\"\n#9000\n1!\n#19000\n"));
  EXPECT_THAT(drawn(2), StartsWith("#0\n1!\n1\"\n0#\n1$\n#1000\n0!\n1#\n0$\n#1500\n0\"\n#2000\n1\"\n0#\n1$\n"));
  EXPECT_THAT(drawn(3), StartsWith("#0\n1!\n1\"\n0#\n1$\n#1000\n0!\n0\"\n1#\n0$\n#1500\n1\"\n#2000\n0\"\n0#\n1$\n"));
}

TEST(Waveform, SpiClockBeginsAfterSelectLead) {
  Picture waveform(LinkKind::spi, {.rate = 1'000'000, .spi_mode = 1, .select_lead = 5us});
  const std::array<std::uint8_t, 1> out{0x80};
  const std::array<std::uint8_t, 1> in{0xFF};
  waveform.transfer({1us, 14us, 8, out, in, 5us});
  EXPECT_THAT(body(waveform),
              ::testing::StartsWith("#0\n1!\n0\"\n0#\n1$\n#1000\n0!\n#6000\n1\"\n1#\n#6500\n0\"\n#7000\n"));
}

TEST(Waveform, ClockedBits) {
  Picture at_once(LinkKind::clocked, slow);
  const std::array<std::uint8_t, 1> bits{0x50};  // the encoder sends the three bits 010
  at_once.transfer({1us, 4us, 3, {}, bits});
  EXPECT_EQ(body(at_once),
            "#0\n1!\n1\"\n#1000\n0!\n0\"\n#1500\n1!\n1\"\n#2000\n0!\n#2500\n1!\n0\"\n#3000\n0!\n"
            "#3500\n1!\n1\"\n#14000\n");
  Picture after_an_edge(LinkKind::clocked, {.rate = 1'000'000, .idle_clocks = 1});
  after_an_edge.transfer({1us, 4us, 3, {}, bits});
  EXPECT_EQ(body(after_an_edge),
            "#0\n1!\n1\"\n#1000\n0!\n#1500\n1!\n0\"\n#2000\n0!\n#2500\n1!\n1\"\n#3000\n0!\n"
            "#3500\n1!\n0\"\n#4000\n0!\n#4500\n1!\n1\"\n#14500\n");
}

TEST(Waveform, DataLineThatTurns) {
  Picture picture(LinkKind::clocked_bidirectional, slow);
  const std::array<std::uint8_t, 1> host{0x40};    // the host sends the bits 01
  const std::array<std::uint8_t, 1> device{0x20};  // the encoder sends the bits 001
  Line<std::uint8_t>::Transfer first{0us, 5us, 5, host, device};
  first.out_bits = 2;
  first.goes_on = true;
  picture.transfer(first);
  Line<std::uint8_t>::Transfer second{9us, 10us, 1, host, {}};
  second.out_bits = 1;
  second.goes_on_from = 5us;
  picture.transfer(second);
  // ! clock, " data, # direction: the host's bits begin at falling edges, the encoder's at rising ones.
  EXPECT_EQ(body(picture),
            "#0\n0!\n0\"\n1#\n#500\n1!\n#1000\n0!\n1\"\n#1500\n1!\n#2000\n0!\n0#\n"
            "#2500\n1!\n0\"\n#3000\n0!\n#3500\n1!\n#4000\n0!\n#4500\n1!\n1\"\n#5000\n0!\n#9000\n0\"\n1#\n"
            "#9500\n1!\n#10000\n1\"\n0#\n#20000\n");
}

TEST(Waveform, DataIsLowForTheTimeoutBehindTheLastEdge) {
  const std::array<std::uint8_t, 1> ones{0xE0};
  Picture picture(LinkKind::clocked, slow);
  Line<std::uint8_t>::Transfer seen{1us, 4us, 3, {}, ones};
  seen.low_after = 20us;
  picture.transfer(seen);
  EXPECT_THAT(body(picture), ::testing::EndsWith("#3000\n0!\n#3500\n1!\n0\"\n#23500\n1\"\n#33500\n"));

  // Times for which the device holds the data line low after the last bit.
  biss::Format biss{};
  const auto biss_low = [&] {
    biss::testing::Bench bench(biss::line_settings, biss);
    Time low{};
    bench.line.observe_transfers([&low](const auto& one) { low = one.low_after; });
    biss::ReadPosition read(biss);
    bench.run(read);
    EXPECT_EQ(read.error(), Error::none);
    return low;
  };
  EXPECT_EQ(biss_low(), 20us);
  biss.timeout = biss::Timeout::fixed(12'500ns);
  EXPECT_EQ(biss_low(), 12'500ns);
  biss.timeout = biss::Timeout::adaptive();
  EXPECT_EQ(biss_low(), 1'500ns);
  const auto ssi_low = [](const ssi::Format& format) {
    biss::testing::ClockedBench<ssi::VirtualEncoder> bench(ssi::line_settings, format);
    Time low{};
    bench.line.observe_transfers([&low](const auto& one) { low = one.low_after; });
    ssi::ReadPosition read(format);
    bench.run(read);
    EXPECT_EQ(read.error(), Error::none);
    return low;
  };
  EXPECT_EQ(ssi_low({}), 20us);
  EXPECT_EQ(ssi_low({.monoflop = 9us}), 9us);
  EXPECT_EQ(ssi_low({.after_word = ssi::AfterWord::one}), 0us);
}

TEST(Waveform, PulsesHaveWiresOfTheirOwn) {
  Picture waveform(LinkKind::full_duplex, slow);
  waveform.pulse(ExtraWire::trigger, 1us, 3us);
  waveform.pulse(ExtraWire::clear, 5us, 6us);
  EXPECT_THAT(waveform.vcd(), HasSubstr("$var wire 1 # trigger $end\n$var wire 1 $ clear $end\n"));
  EXPECT_EQ(body(waveform), "#0\n1!\n1\"\n1#\n1$\n#1000\n0#\n#3000\n1#\n#5000\n0$\n#6000\n1$\n#16000\n");
}

// Level changes go to the sink early, because those of a long drawing would fill the memory.
TEST(Waveform, PassesSettledChangesToSink) {
  struct Counter final : Waveform::Sink {
    void change(Time at, std::size_t) override {
      EXPECT_GE(at, last);
      last = at;
    }
    void comment(Time at, std::string_view) override { commented = at; }
    Time last{};
    Time commented{};
  };
  Counter counter;
  Line<std::uint8_t> line(LinkKind::full_duplex, slow);
  Waveform waveform(LinkKind::full_duplex, slow, counter);
  waveform.observe(line);
  toy::Toy<std::uint8_t> host;
  toy::Toy<std::uint8_t> device;
  host.send({0x00, 0x55, 0x00, 0x55}, 10us);
  device.send({0x55, 0x00, 0x55, 0x00}, 14us);
  line.attach(NodeRole::host, host);
  line.attach(NodeRole::device, device);
  line.run_until(45us);  // at this time both senders are sending their fourth character
  EXPECT_EQ(line.settled(), 40us);
  EXPECT_EQ(counter.last, 33us);
  EXPECT_EQ(counter.commented, 30us);
  line.run_until(100us);
  EXPECT_EQ(line.settled(), 100us);
  waveform.finish();
  EXPECT_EQ(counter.last, 53us);
}

// Compares drawn waveforms with independent decoders, those of sigrok-cli.
struct Sigrok : ::testing::Test {
  Sigrok() {
    std::string name = std::filesystem::temp_directory_path() / "absenc-vcd-XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp");
    directory = name;
  }
  ~Sigrok() override { std::filesystem::remove_all(directory); }

  // Returns the annotations of a sigrok decoder, one after the other, without the decoder's name.
  [[nodiscard]] std::string decode(Picture& waveform, const std::string& decoder, const std::string& what) const {
    const std::filesystem::path file = directory / "waveform.vcd";
    std::ofstream(file) << waveform.vcd();
    const std::string command =
        "sigrok-cli -I vcd -i " + file.string() + " -P " + decoder + " -A " + what + " 2>&1 </dev/null";
    FILE* pipe = ::popen(command.c_str(), "r");
    EXPECT_NE(pipe, nullptr);
    std::string text;
    std::array<char, 4096> part;
    while (const std::size_t size = ::fread(part.data(), 1, part.size(), pipe)) text.append(part.data(), size);
    EXPECT_EQ(::pclose(pipe), 0) << command << '\n' << text;
    std::string values;
    for (std::size_t from = 0, to = 0; (to = text.find('\n', from)) != std::string::npos; from = to + 1) {
      const std::string row = text.substr(from, to - from);
      values += row.substr(row.find(": ") + 2) + ' ';
    }
    return values;
  }

  std::filesystem::path directory;
};

// Returns `bits` as sigrok's SPI decoder prints the bits of one word: the last bit first.
std::string bits_of(BitView bits) {
  std::string text;
  for (std::size_t i = bits.size; i-- > 0;) text += bits[i] ? "1 " : "0 ";
  return text;
}

TEST_F(Sigrok, ReadsTheBitsOfSsi) {
  constexpr ssi::Format format{.word = "multiturn:12 position:13 gray"_word, .extra_clocks = 25};
  biss::testing::ClockedBench<ssi::VirtualEncoder> bench(ssi::line_settings, format);
  Picture waveform(LinkKind::clocked, ssi::line_settings);
  waveform.observe(bench.line);
  bench.shaft.state.position = 0x123'95C6'1234;
  ssi::ReadPosition read(format);
  bench.run(read);
  ASSERT_EQ(read.error(), Error::none);
  const std::string bits = bits_of({read.exchange().received, 50});
  EXPECT_THAT(bits, ::testing::AllOf(HasSubstr("0 1"), HasSubstr("1 0")));
  // A controller in mode 2 reads the idle level first and then the word.
  EXPECT_EQ(decode(waveform, "spi:clk=clock:miso=data:cpol=1:cpha=0:wordsize=51", "spi=miso-bits"), bits + "1 ");
}

TEST_F(Sigrok, ReadsTheSamplesOfBiss) {
  constexpr biss::Format format{.word = "multiturn:16 position:19 error:1! warning:1!"_word};
  biss::testing::Bench bench(biss::line_settings, format);
  Picture waveform(LinkKind::clocked, biss::line_settings);
  waveform.observe(bench.line);
  bench.shaft.state.position = 0x123'95C6'1234;
  biss::ReadPosition read(format);
  bench.run(read);
  ASSERT_EQ(read.error(), Error::none);
  const Time latency = std::chrono::microseconds(10);
  const std::size_t clocks = biss::clocks(format, latency, biss::line_settings.bits(1));
  const std::string bits = bits_of({read.exchange().received, clocks});
  EXPECT_EQ(
      decode(waveform, "spi:clk=clock:miso=data:cpol=1:cpha=0:wordsize=" + std::to_string(clocks), "spi=miso-bits"),
      bits);
}

TEST_F(Sigrok, ReadsSpiInEveryMode) {
  for (std::uint8_t mode = 0; mode < 4; ++mode) {
    const LineSettings settings{.rate = 4'000'000, .spi_mode = mode};
    Line<std::uint8_t> line(LinkKind::spi, settings);
    Picture waveform(LinkKind::spi, settings);
    waveform.observe(line);
    toy::Toy<std::uint8_t> device([](auto& self, const Event<std::uint8_t>& event) {
      if (event.kind == Event<std::uint8_t>::Kind::selected) self.send({0xA1, 0x5E, 0xC3});
    });
    toy::Toy<std::uint8_t> host;
    host.send({0x11, 0x93}, 10us, 0, 3);
    line.attach(NodeRole::device, device);
    line.attach(NodeRole::host, host);
    line.run_until(100us);
    const std::string decoder =
        "spi:clk=sck:miso=miso:mosi=mosi:cs=cs:cpol=" + std::to_string(mode / 2) + ":cpha=" + std::to_string(mode % 2);
    EXPECT_EQ(decode(waveform, decoder, "spi=miso-data"), "A1 5E C3 ") << int{mode};
    EXPECT_EQ(decode(waveform, decoder, "spi=mosi-data"), "11 93 00 ") << int{mode};
  }
}

TEST_F(Sigrok, ReadsFramesOfCan) {
  const LineSettings settings{.rate = 500'000};
  Picture waveform(LinkKind::can, settings);
  Time at = 50us;
  const auto add = [&](const CanFrame& frame) {
    waveform.frame(at, frame);
    at += settings.bits(can_bits(frame).size() + can_intermission_bits);
  };
  add({.id = 0x000, .size = 8});  // the data bytes of this CAN frame cause many stuff bits
  add({.id = 0x120, .size = 3, .data = {0x47, 0x26, 0xFF}});
  add({.id = 0x1ABCDE01, .extended = true, .size = 1, .data = {0x5A}});
  add({.id = 0x7E5, .remote = true});
  add({.id = 0x100});
  const std::string decoder = "can:can_rx=can:nominal_bitrate=500000";
  std::string zeros;
  for (char byte = '0'; byte < '8'; ++byte) zeros += std::string("Data byte ") + byte + ": 0x00 ";
  EXPECT_EQ(decode(waveform, decoder, "can=data"),
            zeros + "Data byte 0: 0x47 Data byte 1: 0x26 Data byte 2: 0xff Data byte 0: 0x5a ");
  EXPECT_EQ(decode(waveform, decoder, "can=id:ext-id"),
            "Identifier: 0 (0x0) Identifier: 288 (0x120) Identifier: 1711 (0x6af) Extended Identifier: 56833 (0xde01) "
            "Identifier: 2021 (0x7e5) Identifier: 256 (0x100) ");
  std::string ends;
  for (int i = 0; i < 5; ++i) ends += "CRC delimiter: 1 ACK slot: ACK ACK delimiter: 1 End of frame ";
  EXPECT_EQ(decode(waveform, decoder, "can=crc-delimiter:ack-slot:ack-delimiter:eof:warnings"), ends);
}

TEST_F(Sigrok, ReadsTheBytesOfTformat) {
  tformat::testing::Bench bench;
  Picture waveform(LinkKind::half_duplex, tformat::line_settings);
  waveform.observe(bench.line);
  bench.shaft.put(3, 4660);
  bench.pass(20us);  // a sigrok decoder needs to see the line idle first
  tformat::ReadPosition read({});
  bench.run(read);
  ASSERT_EQ(read.error(), Error::none);
  std::string bytes;
  for (const Bytes part : {read.exchange().sent, read.exchange().received}) {
    for (const std::uint8_t byte : part) bytes += toy::hex(byte, 2) + ' ';
  }
  EXPECT_THAT(bytes, ::testing::StartsWith("1A 1A "));
  EXPECT_EQ(decode(waveform, "uart:rx=line:baudrate=2500000", "uart=rx-data"), bytes);
}

}  // namespace
}  // namespace absenc::sim
