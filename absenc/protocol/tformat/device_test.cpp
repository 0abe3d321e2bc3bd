// SPDX-License-Identifier: Apache-2.0
// Tests of the virtual Smart-Abs against the paragraphs of its specification.
#include "absenc/protocol/tformat/device.hpp"

#include <gtest/gtest.h>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/tformat/bench_test.hpp"

namespace absenc::tformat {
namespace {

using testing::Bench;
using testing::PowerOn;
using testing::reset;
using testing::wire;
using testing::Wire;

Wire memory_write(Bench& bench, std::uint8_t address, std::uint8_t value) {
  return bench.raw(wire(Request{DataId::write_memory, address, value}));
}
Wire memory_read(Bench& bench, std::uint8_t address) { return bench.raw(wire(Request{DataId::read_memory, address})); }

TEST(TformatDevice, AnswersThreeMicrosecondsAfterTheRequest) {
  Bench bench;
  testing::RawHost host({0x1A}, 5us);
  bench.run(host);
  EXPECT_EQ(host.sent_at, 9us);
  EXPECT_EQ(host.first_byte_at, 9us + 3us + 4us);
}

TEST(TformatDevice, CountsRoundTheTurnAndBelowZero) {
  Bench bench;
  bench.shaft.put(-1, 0x1FFFF);
  const Reply reply = bench.everything();
  EXPECT_EQ(reply.singleturn, 0x1FFFFu);
  EXPECT_EQ(reply.multiturn, 0xFFFFu);
  // The alarm counter_overflow is raised, because the turn counter started at 0 and went below it.
  EXPECT_EQ(reply.alarms, alarms::counter_overflow);

  testing::TestShaft below_zero;
  below_zero.put(-1, 0);
  VirtualEncoder encoder({}, below_zero);
  encoder.power_on(Time{}, PowerOn::skip);
  EXPECT_EQ(encoder.everything(Time{}).multiturn, 0xFFFFu);
  // the alarm counter_overflow is not raised, because the turn counter started at this value
  EXPECT_EQ(encoder.everything(Time{}).alarms, 0);
}

// ---- Abnormal requests (8.4, 9.4)

TEST(TformatDevice, AnswersAbnormalRequestsLikeId3) {
  Bench bench;
  const Wire plain = wire(Reply{.encoder_id = 0x11});
  const Wire parity = wire(Reply{.status = status::parity_error, .encoder_id = 0x11});
  EXPECT_EQ(bench.raw({0x9A}), parity);               // request with ID 3 and a wrong parity bit
  EXPECT_EQ(bench.raw({control_field(0x4)}), plain);  // request with an unknown ID
  EXPECT_EQ(bench.raw({0xEA, 0x01, 0xEC}), plain);    // request with a wrong CRC
  EXPECT_EQ(bench.raw({0xEA, 0x01}), plain);          // incomplete request
  // request with the busy bit, which only replies may have
  EXPECT_EQ(bench.raw({0x32, 0x81, 0x00, 0x32 ^ 0x81}), plain);
  EXPECT_EQ(bench.raw({0x00}), Wire{});           // request with a wrong sync code, which is not answered
  EXPECT_EQ(bench.raw({0x00, 0x1A}), plain);      // a wrong byte, then the request 1A, which is answered
  EXPECT_EQ(memory_write(bench, 127, 6), plain);  // request to select page 6, which users cannot access
  EXPECT_EQ(memory_write(bench, 127, 7), wire(hex<"327F074A">));
  bench.pass(memory_time);
  EXPECT_EQ(memory_read(bench, 3), plain);  // request to read address 3 of page 7, which users cannot access
  EXPECT_EQ(memory_write(bench, 5, 1), plain);
  EXPECT_EQ(memory_read(bench, 4), wire(hex<"EA04DA34">));
  EXPECT_EQ(memory_read(bench, 5), wire(Reply{.id = DataId::read_memory, .address = 5, .value = 35}));
}

TEST(TformatDevice, AnswersRefusedFrameAfterItsEnd) {
  Bench bench;
  testing::RawHost host({0x6A, 0x05, 0xEF});
  bench.run(host);
  EXPECT_EQ(host.reply, wire(Reply{.status = status::parity_error, .encoder_id = 0x11}));
  EXPECT_GE(host.first_byte_at - host.sent_at, answer_time);
  EXPECT_EQ(bench.encoder.answer_count(), 1u);
  EXPECT_EQ(bench.violations(), 0u);
  for (const Wire& request : {Wire{0xA2, 0x05, 0xEF, 0x01}, Wire{0x32, 0x81, 0x00, 0xB3, 0x00}}) {
    EXPECT_EQ(bench.raw(request), wire(Reply{.encoder_id = 0x11}));
  }
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(TformatDevice, DamagedCharacterIsADelimiterError) {
  Bench bench;
  LineSettings slow = line_settings;
  slow.rate = 1'000'000;
  struct WrongRate final : Machine<std::uint8_t> {
    explicit WrongRate(LineSettings rate) : settings(rate) {}
    void feed(const Event<std::uint8_t>&) override {}
    Step<std::uint8_t> next(Time) override {
      using Kind = Step<std::uint8_t>::Kind;
      if (step == 0) return ++step, Step<std::uint8_t>{.kind = Kind::configure, .rate = settings.rate};
      if (step == 1) return ++step, Step<std::uint8_t>{.kind = Kind::transfer, .out = byte};
      return {.at = never};
    }
    LineSettings settings;
    int step = 0;
    std::array<std::uint8_t, 1> byte{0x1A};
  } host(slow);
  std::vector<std::uint8_t> answer;
  bench.line.observe([&answer](auto sender, Time, Time, std::uint8_t byte) {
    if (sender == 0) answer.push_back(byte);
  });
  bench.line.attach(sim::NodeRole::host, host);
  bench.pass(1ms);
  EXPECT_EQ(answer, wire(Reply{.status = status::delimiter_error, .encoder_id = 0x11}));
}

// ---- Memory (6.3.5)

TEST(TformatDevice, IsBusyFor18MillisecondsAfterAWrite) {
  Bench bench;
  memory_write(bench, 5, 0x77);
  const Time written = bench.line.now();
  EXPECT_EQ(memory_read(bench, 5), wire(hex<"EA85006F">));
  EXPECT_EQ(memory_write(bench, 6, 1), wire(hex<"328600B4">));
  bench.line.run_until(written + memory_time);
  EXPECT_EQ(memory_read(bench, 5), wire(Reply{.id = DataId::read_memory, .address = 5, .value = 0x77}));
  // The encoder did not execute the write that came during its busy time.
  EXPECT_EQ(memory_read(bench, 6), wire(Reply{.id = DataId::read_memory, .address = 6}));
  EXPECT_EQ(bench.encoder.writes(), 1u);
  EXPECT_EQ(bench.violations(), 0u);  // an access while the encoder writes does not count as a violation
}

TEST(TformatDevice, PagesAreSeparateAndChangingThemTakesTime) {
  Bench bench;
  for (std::uint8_t page = 0; page < user_pages; ++page) {
    memory_write(bench, 127, page);
    bench.pass(memory_time);
    memory_write(bench, 126, static_cast<std::uint8_t>(0xA0 + page));
    bench.pass(memory_time);
  }
  EXPECT_EQ(bench.encoder.writes(), 6u);  // the count of EEPROM writes excludes page changes
  memory_write(bench, 127, 2);
  memory_read(bench, 126);
  ASSERT_EQ(bench.violations(), 1u);
  EXPECT_EQ(bench.encoder.violations()[0].rule, "memory access before the page is ready");
  bench.pass(memory_time);
  EXPECT_EQ(memory_read(bench, 126)[2], 0xA2);
  // After power on the encoder has page 0 selected at once.
  memory_write(bench, 126, 1);
  bench.restart();
  EXPECT_EQ(memory_read(bench, 126)[2], 0xA0);
}

// ---- Resets (10)

TEST(TformatDevice, TenRequestsMakeAReset) {
  Bench bench;
  bench.shaft.put(7, 1000);
  bench.encoder.raise_alarms(alarms::over_heat | alarms::counter_overflow);
  reset(bench, DataId::clear_alarms, 9);
  EXPECT_NE(bench.everything().alarms, 0);  // a read of the position restarts the encoder's count of reset requests
  reset(bench, DataId::clear_alarms, 9);
  EXPECT_NE(bench.raw({0xBA})[1] & status::alarm, 0);  // the tenth reply of a reset still shows the old alarms
  bench.pass(40us);
  EXPECT_EQ(bench.everything().alarms, 0);
  EXPECT_EQ(bench.everything().multiturn, 7u);
  reset(bench, DataId::reset_multiturn);
  EXPECT_EQ(bench.everything().multiturn, 0u);
  EXPECT_EQ(bench.everything().singleturn, 1000u);
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(TformatDevice, OtherRequestRestartsTheCount) {
  Bench bench;
  bench.shaft.put(7, 0);
  reset(bench, DataId::reset_multiturn, 9);
  bench.raw({0xEA, 0x01, 0xEC});  // a request with a wrong CRC restarts the encoder's count of reset requests
  reset(bench, DataId::reset_multiturn, 9);
  EXPECT_EQ(bench.everything().multiturn, 7u);
  reset(bench, DataId::clear_alarms, 9);
  reset(bench, DataId::reset_multiturn, 1);
  EXPECT_EQ(bench.everything().multiturn, 7u);
}

TEST(TformatDevice, ZeroLeavesTheTurns) {
  Bench bench;
  bench.shaft.put(7, 0x1F000);
  reset(bench, DataId::zero);
  bench.pass(memory_time);
  bench.shaft.put(7, 0x100);
  EXPECT_EQ(bench.everything().multiturn, 6u);
  reset(bench, DataId::zero);
  bench.pass(memory_time);
  EXPECT_EQ(bench.everything().singleturn, 0u);
  EXPECT_EQ(bench.everything().multiturn, 6u);
}

TEST(TformatDevice, ZeroIsLostIfNotWrittenBeforePowerOff) {
  Bench bench;
  bench.shaft.put(0, 1000);
  reset(bench, DataId::zero);
  bench.restart();
  bench.pass(memory_time);
  EXPECT_EQ(bench.everything().singleturn, 1000u);
}

TEST(TformatDevice, ZeroTakes18MillisecondsAndSurvivesPowerOff) {
  Bench bench;
  bench.shaft.put(7, 1000);
  reset(bench, DataId::zero);
  EXPECT_EQ(bench.everything().singleturn, 1000u);
  EXPECT_EQ(memory_read(bench, 1)[1] & busy_bit, busy_bit);
  bench.pass(memory_time);
  EXPECT_EQ(bench.everything().singleturn, 0u);
  EXPECT_EQ(bench.everything().multiturn, 7u);
  bench.restart();
  EXPECT_EQ(bench.everything().singleturn, 0u);
  bench.shaft.put(7, 999);
  EXPECT_EQ(bench.everything().singleturn, 0x1FFFFu);
  EXPECT_EQ(bench.everything().multiturn, 6u);
}

TEST(TformatDevice, ResetsSentTooFastOrOnATurningShaftDoNothing) {
  Bench bench;
  bench.shaft.put(3, 0);
  // each request follows the reply before it at once, so the requests are 31 us apart
  for (unsigned i = 0; i < 20; ++i) {
    testing::RawHost host({0x62}, bench.line.now());
    bench.line.put_on(host);
    while (host.reply.size() < 6) bench.line.step();
  }
  EXPECT_EQ(bench.encoder.everything(bench.line.now()).multiturn, 3u);
  ASSERT_GT(bench.violations(), 0u);
  EXPECT_EQ(bench.encoder.violations()[0].rule, "reset sent too fast: less than 40 us after the one before");

  Bench exact;
  exact.shaft.put(3, 0);
  for (unsigned i = 0; i < reset_requests; ++i) {
    testing::RawHost host({0x62}, exact.line.now() + 9us);
    exact.line.put_on(host);
    while (host.reply.size() < 6) exact.line.step();
  }
  EXPECT_EQ(exact.violations(), 0u);
  EXPECT_EQ(exact.encoder.everything(exact.line.now()).multiturn, 0u);

  Bench turning;
  turning.shaft.put(3, 0);
  turning.shaft.spin(10, Time{});
  reset(turning, DataId::reset_multiturn);
  EXPECT_EQ(turning.everything().multiturn, 3u);
  ASSERT_EQ(turning.violations(), 1u);
  EXPECT_EQ(turning.encoder.violations()[0].rule, "reset while the shaft turns");
}

TEST(TformatDevice, RequestDuringTransmissionIsAViolation) {
  Bench bench;
  testing::RawHost host({0x1A, 0x1A});
  bench.run(host);
  ASSERT_EQ(bench.violations(), 1u);
  EXPECT_EQ(bench.encoder.violations()[0].rule, "request during the encoder's transmission");
  Bench longer;
  longer.raw({0x1A, 0xEA, 0x05, 0xEF});
  EXPECT_EQ(longer.violations(), 1u);
  // The four bytes behind the first request are two further requests, so they count as two violations.
  testing::TestShaft shaft;
  VirtualEncoder encoder({}, shaft);
  encoder.power_on(Time{}, PowerOn::skip);
  const Wire all{0x1A, 0xEA, 0x05, 0xEF, 0x1A};
  encoder.feed({.kind = Event<std::uint8_t>::Kind::received, .at = 1us, .items = all});
  EXPECT_EQ(encoder.violation_count(), 2u);
  // If the bytes were delivered late, the reply may have ended before the other requests arrived, so these are no
  // violations.
  for (const auto& [late, rules] : {std::pair(20us, 2u), {900us, 2u}, {1500us, 1u}, {3ms, 0u}}) {
    VirtualEncoder delayed({}, shaft);
    delayed.power_on(Time{}, PowerOn::skip);
    delayed.feed({.kind = Event<std::uint8_t>::Kind::received, .at = 4ms, .items = all, .late = late});
    EXPECT_EQ(delayed.violation_count(), rules) << late.count();
  }
}

TEST(TformatDevice, DetectsRequestsWithoutPauseInAnyPieces) {
  testing::TestShaft shaft;
  const Wire one{0x1A};
  const Wire two{0x1A, 0x1A};
  using Kind = Event<std::uint8_t>::Kind;
  for (const bool answered : {false, true}) {
    VirtualEncoder encoder({}, shaft);
    encoder.power_on(Time{}, PowerOn::skip);
    encoder.feed({.kind = Kind::received, .at = 1us, .items = one});
    encoder.next(1us);
    if (answered) encoder.feed({.kind = Kind::sent, .at = 2us});
    encoder.feed({.kind = Kind::received, .at = 3us, .items = two, .late = 200us});
    EXPECT_EQ(encoder.violation_count(), answered ? 1u : 2u);
    EXPECT_EQ(encoder.violations()[0].rule, "request during the encoder's transmission");
  }
}

TEST(TformatDevice, HostThatNeverWaitsIsNotExcused) {
  testing::TestShaft shaft;
  VirtualEncoder encoder({}, shaft);
  encoder.power_on(Time{}, PowerOn::skip);
  const Wire thrice{0x1A, 0x1A, 0x1A};
  const Wire once{0x1A};
  Time now = 1s;
  const auto ask = [&](const Wire& request) {
    now += 100ms;
    encoder.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = request, .late = 50ms});
    encoder.next(now);
    encoder.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    return encoder.violation_count();
  };
  EXPECT_EQ(ask(thrice), 0u);
  EXPECT_EQ(ask(thrice), 0u);
  EXPECT_EQ(ask(thrice), 2u);
  EXPECT_EQ(ask(thrice), 4u);
  // After a single request, three requests that arrive late and together do not count as violations: the host may have
  // waited for each reply.
  EXPECT_EQ(ask(once), 4u);
  EXPECT_EQ(ask(thrice), 4u);
}

// Some broken rules do not count as violations of the host; the encoder reports them to its RuleWatch only (9.1, 10).
TEST(TformatDevice, ReportsRulesThatAreNoViolations) {
  using Rules = std::vector<std::string>;
  const std::string again = "what was refused as busy was not asked for again";
  Bench bench;
  author::testing::BrokenRules broken;
  bench.encoder.watch_rules(&broken);
  memory_write(bench, 5, 1);
  memory_read(bench, 5);  // the encoder replies that it is busy
  memory_read(bench, 5);
  EXPECT_EQ(broken.rules, Rules{});
  memory_read(bench, 6);
  EXPECT_EQ(broken.rules, Rules{again});
  broken.rules.clear();
  memory_write(bench, 6, 1);
  EXPECT_EQ(broken.rules, (Rules{again, "memory written while the encoder writes"}));
  broken.rules.clear();
  bench.pass(18ms);
  reset(bench, DataId::zero, 9);
  bench.everything();
  EXPECT_EQ(broken.rules, Rules{"reset not sent ten times in a row"});
  EXPECT_EQ(bench.violations(), 0u);
}

}  // namespace
}  // namespace absenc::tformat
