// SPDX-License-Identifier: Apache-2.0
// The virtual AksIM-2 by itself: what it answers, when, and which rules it watches.
#include "absenc/protocol/encolink/device.hpp"

#include <gtest/gtest.h>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/encolink/bench_test.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using PowerOn = Device<std::uint8_t>::PowerOn;
using RawBytes = std::vector<std::uint8_t>;

/// Sends requests one after the other, each when the reply before has ended, and keeps the replies.
class RawHost final : public Machine<std::uint8_t> {
 public:
  RawHost(std::vector<RawBytes> requests, std::size_t expect, Time pause)
      : requests_(std::move(requests)), expect_(expect), pause_(pause) {}

  void feed(const Event<std::uint8_t>& event) override {
    using Kind = Event<std::uint8_t>::Kind;
    last_ = event.at;
    if (event.kind == Kind::sent) {
      sent_at = event.at;
    } else if (event.kind == Kind::received) {
      if (replies.back().empty()) first_byte_at = event.at;
      replies.back().insert(replies.back().end(), event.items.begin(), event.items.end());
    } else if (event.kind == Kind::silence) {
      waiting_ = false;
    }
  }
  Step<std::uint8_t> next(Time) override {
    using Kind = Step<std::uint8_t>::Kind;
    if (waiting_) return {.at = never, .answer = 300us, .gap = 15us};
    if (replies.size() == requests_.size()) return {.kind = Kind::done};
    waiting_ = true;
    replies.emplace_back();
    return {.kind = Kind::transfer, .out = requests_[replies.size() - 1], .expect = expect_, .at = last_ + pause_};
  }

  std::vector<RawBytes> replies;
  Time sent_at{};
  Time first_byte_at{};

 private:
  std::vector<RawBytes> requests_;
  std::size_t expect_;
  Time pause_;
  Time last_{};
  bool waiting_ = false;
};

std::vector<RawBytes> ask(Bench& bench, std::vector<RawBytes> requests, std::size_t expect = 0, Time pause = 5us) {
  RawHost host(std::move(requests), expect, pause);
  bench.drive(host);
  return host.replies;
}

RawBytes wire_of(Bytes bytes) { return {bytes.begin(), bytes.end()}; }
const RawBytes position_request{0x00, 0x00};

TEST(EncolinkDevice, AnswersFiveMicrosecondsAfterTheRequest) {
  Bench bench(testing::single);
  RawHost host({position_request}, 0, 0us);
  bench.drive(host);
  EXPECT_EQ(host.sent_at, 20us);
  EXPECT_EQ(host.first_byte_at, 20us + answer_time + 10us);
  EXPECT_EQ(RawBytes(host.replies[0].begin(), host.replies[0].begin() + 4),
            wire_of(encode_position(testing::single, {.singleturn = 0x12345}).view().first(4)));
}

TEST(EncolinkDevice, TheIdentityComesInTheFrameAfterItsRequest) {
  for (const Wire wire : {Wire::uart, Wire::spi}) {
    Bench bench(testing::multi, wire);
    const auto replies =
        ask(bench, {{0xBB, 0x00}, position_request, position_request}, wire == Wire::spi ? identity_bytes : 0);
    EXPECT_TRUE(decode_position(testing::multi, Bytes(replies[0]).first(7)).has_value());
    ASSERT_EQ(replies[1].size(), identity_bytes);
    const Result<Identity> identity = decode_identity(replies[1]);
    ASSERT_TRUE(identity.has_value());
    EXPECT_EQ(identity->resolution, 20u);
    EXPECT_EQ(identity->frame_bytes, 7);
    EXPECT_TRUE(decode_position(testing::multi, Bytes(replies[2]).first(7)).has_value());
  }
}

TEST(EncolinkDevice, CyclesBeginInTheFrameAfterTheReset) {
  Bench bench(testing::single);
  std::vector<RawBytes> requests(10, position_request);
  requests[2] = {0xAA, 0x00};
  const auto replies = ask(bench, requests);
  RawBytes cycle;
  for (std::size_t i = 3; i < 10; ++i) cycle.push_back(replies[i].back());
  EXPECT_EQ(cycle, wire_of(encode_cycle(testing::single, {{.singleturn = 0x12345}, 0, channel3::idle})));
}

TEST(EncolinkDevice, OtherConfigBytesAreIgnored) {
  Bench bench(testing::single);
  const auto replies = ask(bench, {{0xAB, 0x00}, {0x55, 0x00}, position_request});
  for (const RawBytes& reply : replies) EXPECT_TRUE(decode_position(testing::single, reply).has_value());
}

TEST(EncolinkDevice, ARequestCutShortIsForgotten) {
  Bench bench(testing::single);
  const auto replies = ask(bench, {{0xBB}, position_request, position_request});
  EXPECT_TRUE(replies[0].empty());
  EXPECT_TRUE(decode_position(testing::single, replies[1]).has_value());
  EXPECT_TRUE(decode_position(testing::single, replies[2]).has_value());
}

TEST(EncolinkDevice, ARequestDuringTheReplyIsAViolation) {
  Bench bench(testing::single);
  ask(bench, {{0x00, 0x00, 0x00, 0x00, 0x00, 0x00}});
  ASSERT_EQ(bench.encoder.violation_count(), 2u);  // requests, not bytes
  EXPECT_EQ(bench.encoder.violations()[0].rule, "request during the encoder's transmission");
}

TEST(EncolinkDevice, WatchesTheTimesOfSpi) {
  Bench good(testing::single, Wire::spi);
  ask(good, {position_request, position_request}, 5, 5us);
  EXPECT_EQ(good.encoder.violation_count(), 0u);

  // Without the silence of RawHost between: the next transfer at once.
  struct Hasty final : Machine<std::uint8_t> {
    void feed(const Event<std::uint8_t>& event) override { free = event.kind == Event<std::uint8_t>::Kind::received; }
    Step<std::uint8_t> next(Time) override {
      using Kind = Step<std::uint8_t>::Kind;
      if (configures) return configures = false, Step<std::uint8_t>{.kind = Kind::configure, .settings = settings};
      if (!free) return {.at = never};
      if (left-- == 0) return {.kind = Kind::done};
      free = false;
      return {.kind = Kind::transfer, .out = request, .expect = 5};
    }
    bool configures = true;
    bool free = true;
    int left = 2;
    LineSettings settings = spi_settings;
    std::array<std::uint8_t, 2> request{};
  };
  Bench hasty(testing::single, Wire::spi);
  Hasty host;
  hasty.drive(host);
  ASSERT_EQ(hasty.encoder.violation_count(), 1u);
  EXPECT_EQ(hasty.encoder.violations()[0].rule, "NCS high for less than 5 us");

  Bench fast(testing::single, Wire::spi);
  Hasty too_fast;
  too_fast.left = 1;
  too_fast.settings.rate = 8'000'000;
  fast.drive(too_fast);
  ASSERT_EQ(fast.encoder.violation_count(), 1u);
  EXPECT_EQ(fast.encoder.violations()[0].rule, "clock faster than 4 MHz");

  // How a controller selects is how its line was set up.
  LineSettings settings = spi_settings;
  settings.select_lead = 4999ns;
  Bench early(testing::single, Wire::spi);
  sim::Line<std::uint8_t> line{LinkKind::exchange, settings};
  line.attach(sim::Role::device, early.encoder);
  Hasty too_early;
  too_early.left = 1;
  line.run(line.attach(sim::Role::host, too_early));
  ASSERT_EQ(early.encoder.violation_count(), 1u);
  EXPECT_EQ(early.encoder.violations()[0].rule, "clock less than 5 us after NCS went low");
}

TEST(EncolinkDevice, AnAccessBeforeTheLastOneWasAnsweredIsAViolation) {
  Bench bench(testing::single);
  const AccessBytes access = encode_access(read_request(0x4C, 2));
  std::vector<RawBytes> requests;
  for (unsigned twice = 0; twice < 2; ++twice) {
    for (const std::uint8_t byte : access.view()) requests.push_back({0x00, byte});
  }
  ask(bench, requests);
  ASSERT_GT(bench.encoder.violation_count(), 0u);
  EXPECT_EQ(bench.encoder.violations()[0].rule, "register access before the last one was answered");
}

TEST(EncolinkDevice, SendsWellFormedZerosWhileItStarts) {
  Bench bench(testing::single);
  bench.encoder.power_off(bench.line.now());
  EXPECT_TRUE(ask(bench, {position_request})[0].empty());
  bench.encoder.power_on(bench.line.now(), PowerOn::real);
  const auto early = ask(bench, {{0xAA, 0x00}, position_request});
  EXPECT_EQ(early[1], wire_of(hex<"000003D100">));
  bench.pass(start_up);
  EXPECT_EQ(decode_position(testing::single, ask(bench, {position_request})[0])->singleturn, 0x12345u);
}

TEST(EncolinkDevice, CountsRoundTheTurnAndBelowZero) {
  Bench bench;
  bench.shaft.put(-1, 0xFFFFF);
  EXPECT_EQ(bench.encoder.measure(Time{}).singleturn, 0xFFFFFu);
  EXPECT_EQ(bench.encoder.measure(Time{}).multiturn, 0xFFFFu);
  bench.shaft.put(65536, 0);
  EXPECT_EQ(bench.encoder.measure(Time{}).multiturn, 0u);
}

TEST(EncolinkDevice, AlarmsSetTheTwoBitsOfEveryFrame) {
  Bench bench;
  for (unsigned bit = 0; bit < 16; ++bit) {
    bench.encoder.raise_alarms(1u << bit);
    const Position position = bench.encoder.measure(Time{});
    EXPECT_EQ(position.error, (status::errors >> bit & 1) != 0) << bit;
    EXPECT_EQ(position.warning, (status::warnings >> bit & 1) != 0) << bit;
    bench.encoder.lower_alarms(1u << bit);
  }
  EXPECT_FALSE(bench.encoder.measure(Time{}).error);
}

TEST(EncolinkDevice, TransmitsByItselfAtItsRate) {
  Format format = testing::single;
  format.stream_rate = 2000;
  Bench bench(format);
  std::vector<Time> ends;
  bench.line.observe([&ends](auto, Time, Time end, std::uint8_t) { ends.push_back(end); });
  bench.pass(10ms);
  ASSERT_GE(ends.size(), 5 * 20u);
  EXPECT_EQ(ends[5] - ends[0], 500us);
  EXPECT_EQ(ends[95] - ends[0], 19 * 500us);
}

TEST(EncolinkDevice, KeepsWhatIsSaved) {
  Bench bench;
  EXPECT_EQ(bench.encoder.memory().size(), 31u);
  bench.encoder.power_off(Time{});
  store_big_endian(bench.encoder.memory().first(4), 0x10000);
  bench.encoder.power_on(Time{}, PowerOn::skip);
  EXPECT_EQ(bench.encoder.measure(Time{}).singleturn, 0x12345u + (1u << 16));
}

}  // namespace
}  // namespace absenc::encolink
