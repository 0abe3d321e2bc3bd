// SPDX-License-Identifier: Apache-2.0
// Tests of the virtual AksIM-2 with single requests; the host's code is not used.
#include "absenc/protocol/encolink/device.hpp"

#include "absenc/core/hex.hpp"
#include "absenc/protocol/encolink/bench_test.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using testing::RawBytes;
using PowerOn = Bench::PowerOn;

constexpr const Format& single = testing::single_format;
RawBytes wire_of(Bytes bytes) { return {bytes.begin(), bytes.end()}; }
const RawBytes position_request{0x00, 0x00};

TEST(EncolinkDevice, RepliesFiveMicrosecondsAfterRequest) {
  Bench bench(testing::single);
  const auto host = bench.raw(position_request);
  EXPECT_EQ(host.first_byte_at - host.sent_at, answer_time + 10us);
  EXPECT_EQ(RawBytes(host.reply.begin(), host.reply.begin() + 4),
            wire_of(encode_position(single, {.singleturn = 0x12345}).view().first(4)));
}

TEST(EncolinkDevice, SendsIdentityInFrameAfterRequest) {
  for (const Interface interface : {Interface::uart, Interface::spi}) {
    Bench bench(testing::multi, interface);
    const auto replies =
        bench.ask({{0xBB, 0x00}, position_request, position_request}, interface == Interface::spi ? identity_bytes : 0);
    for (const std::size_t i : {0u, 2u}) {
      EXPECT_TRUE(decode_position(testing::multi_format, Bytes(replies[i]).first(7)).has_value());
    }
    const Result<Identity> identity = decode_identity(replies[1]);
    ASSERT_TRUE(identity.has_value());
    EXPECT_EQ(identity->resolution, 20u);
    EXPECT_EQ(identity->frame_bytes, 7);
  }
}

TEST(EncolinkDevice, BeginsCycleInFrameAfterReset) {
  Bench bench(testing::single);
  std::vector<RawBytes> requests(10, position_request);
  requests[2] = {0xAA, 0x00};
  const auto replies = bench.ask(requests);
  RawBytes cycle;
  for (std::size_t i = 3; i < 10; ++i) cycle.push_back(replies[i].back());
  EXPECT_EQ(cycle, wire_of(encode_cycle(single, {{.singleturn = 0x12345}, 0, channel3::idle})));
}

TEST(EncolinkDevice, DropsInvalidRequest) {
  Bench bench(testing::single);
  const auto replies = bench.ask({{0xAB, 0x00}, {0x55, 0x00}, position_request, {0xBB}, position_request});
  for (std::size_t i = 0; i < replies.size(); ++i) {
    // the request with index 3 has only one byte, so its reply is cut
    EXPECT_EQ(decode_position(single, replies[i]).has_value(), i != 3) << i;
  }
}

TEST(EncolinkDevice, ReportsBrokenRulesOfAccessAndTransmission) {
  const AccessBytes access = encode_access(read_request(0x4C, 2));
  std::vector<RawBytes> two_accesses;
  for (unsigned twice = 0; twice < 2; ++twice) {
    for (const std::uint8_t byte : access.view()) two_accesses.push_back({0x00, byte});
  }
  Bench hasty(testing::single);
  hasty.ask(two_accesses);
  EXPECT_EQ(hasty.first_violation(), "register access before the last one was answered");

  Bench loud(testing::single);
  loud.ask({RawBytes(6)});
  // the six bytes are three requests, two of them during the encoder's reply: violations count per request, not per
  // byte
  EXPECT_EQ(loud.device.violation_count(), 2u);
  EXPECT_EQ(loud.first_violation(), "request during the encoder's transmission");
}

/// Makes two SPI transfers with the pause `pause` between them.
class SpiHost final : public Machine<std::uint8_t> {
 public:
  explicit SpiHost(Time pause) : pause_(pause) {}
  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind != Event<std::uint8_t>::Kind::received) return;
    free_ = true;
    at_ = event.at + pause_;
  }
  Step<std::uint8_t> next(Time) override {
    using Kind = Step<std::uint8_t>::Kind;
    if (!free_) return {.at = never};
    if (left_-- == 0) return {.kind = Kind::done};
    free_ = false;
    return {.kind = Kind::transfer, .out = request_, .expect = 5, .at = at_};
  }

 private:
  Time pause_;
  Time at_{};
  bool free_ = true;
  int left_ = 2;
  std::array<std::uint8_t, 2> request_{};
};

TEST(EncolinkDevice, ReportsBrokenSpiTimes) {
  LineSettings fastest = spi_settings;
  fastest.rate = 4'000'000;
  LineSettings fast = spi_settings;
  fast.rate = 8'000'000;
  LineSettings early = spi_settings;  // an SPI host may have NCS low for less than 5 us before the first clock
  early.select_lead = 4999ns;
  for (const auto& [settings, pause, rule] : std::to_array<std::tuple<LineSettings, Time, std::string>>(
           {{spi_settings, 5us, ""},
            {fastest, 5us, ""},
            {spi_settings, 4999ns, "NCS high for less than 5 us"},
            {fast, 5us, "clock faster than 4 MHz"},
            {early, 5us, "clock less than 5 us after NCS went low"}})) {
    Bench bench(testing::single, Interface::spi);
    sim::Line<std::uint8_t> line{LinkKind::spi, settings};
    line.attach(sim::NodeRole::device, bench.encoder);
    SpiHost host(pause);
    line.run(line.attach(sim::NodeRole::host, host));
    EXPECT_EQ(bench.first_violation(), rule);
  }
}

TEST(EncolinkDevice, SendsWellFormedZerosWhileStarting) {
  Bench bench(testing::single);
  bench.device.power_off(bench.line.now());
  EXPECT_TRUE(bench.ask({position_request})[0].empty());
  bench.device.power_on(bench.line.now(), PowerOn::real);
  EXPECT_EQ(bench.ask({{0xAA, 0x00}, position_request})[1], wire_of(hex<"000003D100">));
  bench.pass(start_up);
  EXPECT_EQ(decode_position(single, bench.ask({position_request})[0])->singleturn, 0x12345u);
}

TEST(EncolinkDevice, CountsAcrossTurnAndBelowZero) {
  Bench bench;
  bench.shaft.put(-1, 0xFFFFF);
  EXPECT_EQ(bench.encoder.measure(Time{}).singleturn, 0xFFFFFu);
  EXPECT_EQ(bench.encoder.measure(Time{}).multiturn, 0xFFFFu);
  bench.shaft.put(65536, 0);
  EXPECT_EQ(bench.encoder.measure(Time{}).multiturn, 0u);
}

TEST(EncolinkDevice, AlarmsSetStatusBitsOfEveryFrame) {
  Bench bench;
  for (unsigned bit = 0; bit < 16; ++bit) {
    bench.device.raise_alarms(1u << bit);
    const Position position = bench.encoder.measure(Time{});
    EXPECT_EQ(position.error, (status::errors >> bit & 1) != 0) << bit;
    EXPECT_EQ(position.warning, (status::warnings >> bit & 1) != 0) << bit;
    bench.device.lower_alarms(1u << bit);
  }
  EXPECT_FALSE(bench.encoder.measure(Time{}).error);
}

TEST(EncolinkDevice, StreamsAtItsRate) {
  Bench bench("resolution=20 multiturn_bits=0 stream_rate=2000");
  std::vector<Time> ends;
  bench.line.observe([&ends](auto, Time, Time end, std::uint8_t) { ends.push_back(end); });
  bench.pass(10ms);
  ASSERT_GE(ends.size(), 5 * 20u);
  EXPECT_EQ(ends[5] - ends[0], 500us);
  EXPECT_EQ(ends[95] - ends[0], 19 * 500us);
}

/// Returns the encoder's answer to a register access: its channel 3 bytes, one from each cycle of channel 2.
RawBytes answer_to(Bench& bench, Bytes access) {
  std::vector<RawBytes> requests(80, position_request);
  requests[0] = {0xAA, 0x00};
  for (std::size_t i = 0; i < access.size(); ++i) requests[1 + i][1] = access[i];
  const auto replies = bench.ask(requests);
  RawBytes answer;
  for (std::size_t first = 1; first + single.cycle_bytes() <= replies.size(); first += single.cycle_bytes()) {
    RawBytes cycle;
    for (std::size_t i = 0; i < single.cycle_bytes(); ++i) cycle.push_back(replies[first + i].back());
    const std::uint8_t told = decode_cycle(single, cycle)->channel3;
    if (told != channel3::idle && told != channel3::busy) answer.push_back(told);
  }
  return answer;
}

TEST(EncolinkDevice, Aksim4RejectsRegistersOfAksim2) {
  const AccessBytes access = encode_access(read_request(0x4C, 2));
  for (const auto& [generation, status] :
       {std::pair<std::string, AccessStatus>{"2", AccessStatus::ok}, {"4", AccessStatus::no_such_register}}) {
    Bench bench(std::string(testing::single) + " protocol_version=" + generation);
    const RawBytes answer = answer_to(bench, access);
    ASSERT_GE(answer.size(), 2u);
    EXPECT_EQ(answer[0], channel3::read_ready);
    EXPECT_EQ(answer[1], static_cast<std::uint8_t>(status));
  }
}

TEST(EncolinkDevice, KeepsSavedValues) {
  Bench bench;
  EXPECT_EQ(bench.device.memory().size(), 31u);
  bench.device.power_off(Time{});
  store_big_endian(bench.device.memory().first(4), 0x10000);
  bench.device.power_on(Time{}, PowerOn::skip);
  EXPECT_EQ(bench.encoder.measure(Time{}).singleturn, 0x12345u + (1u << 16));
}

}  // namespace
}  // namespace absenc::encolink
