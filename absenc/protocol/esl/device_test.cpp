// SPDX-License-Identifier: Apache-2.0
// Tests of the virtual QS35 against its document, mostly with single requests.
#include "absenc/protocol/esl/device.hpp"

#include <gtest/gtest.h>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/esl/bench_test.hpp"

namespace absenc::esl {
namespace {

using testing::Bench;
using testing::PowerOn;
using testing::Wire;
using testing::wire;
using testing::wire_of;

Request memory_read(std::uint8_t address) { return {DataId::read_memory, 0, address}; }
Request memory_write(std::uint8_t address, std::uint8_t value) { return {DataId::write_memory, 0, address, value}; }
Wire memory_reply(const Request& request, bool busy, std::uint8_t value) {
  return wire(Reply{.id = request.id, .memory_address = request.memory_address, .busy = busy, .value = value});
}

TEST(EslDevice, AnswersTwoMicrosecondsAfterTheRequest) {
  Bench bench;
  testing::RawHost host(wire(hex<"0875">), 5us);
  bench.line.converse(host);
  EXPECT_EQ(host.sent_at, 7us);
  EXPECT_EQ(host.first_byte_at, 7us + 2us + 1us);
  EXPECT_EQ(host.reply.size(), 18u);
}

// The sequence counters count requests with data ID 9 or A only if the profile states that all requests are counted.
TEST(EslDevice, SequenceCounters) {
  Bench bench;
  EXPECT_EQ(bench.read(DataId::position).one.sequence, 1);
  bench.read(DataId::temperature);
  bench.read(DataId::alarms);
  const Reply second = bench.read(DataId::singleturn);
  EXPECT_EQ(second.one.sequence, 2);
  EXPECT_EQ(second.two.sequence, 2);
  Bench each({.sequence_step = SequenceStep::request});
  each.raw(Request{DataId::temperature});
  EXPECT_EQ(each.read(DataId::position).one.sequence, 2);
  for (unsigned i = 2; i < 256; ++i) bench.read(DataId::position);
  // both sequence counters have wrapped: that of channel 1 has 8 bits, that of channel 2 has 7 bits
  EXPECT_EQ(bench.read(DataId::position).one.sequence, 1);
  EXPECT_EQ(bench.read(DataId::position).two.sequence, 2);
}

TEST(EslDevice, AnswersOnlyItsOwnValidRequests) {
  Bench bench;
  EXPECT_TRUE(bench.raw(wire(hex<"0874">)).empty());               // request with a wrong CRC
  EXPECT_TRUE(bench.raw(wire_of({DataId::position, 3})).empty());  // request to another address
  EXPECT_TRUE(bench.raw(wire(hex<"18">)).empty());                 // request with an unknown ID
  EXPECT_TRUE(bench.raw(wire(hex<"08">)).empty());                 // incomplete request
  // the encoder answers the valid request that follows the faulty ones
  EXPECT_EQ(bench.raw(wire(hex<"0875">)).size(), 18u);
  EXPECT_TRUE(bench.raw(memory_write(page_select_address, 7)).empty());
  EXPECT_TRUE(bench.raw(memory_read(0x30)).empty());  // page 8 of the memory ends at address 0x2F
  EXPECT_EQ(bench.encoder.answer_count(), 1u);
}

// The document demands of an encoder that receives other bytes than a request: "Else, it will continue to search for
// the next available logic of low state."
TEST(EslDevice, FindsRequestAfterOtherBytes) {
  for (const Wire& before : {wire(hex<"AB7B">), wire(hex<"AB">), wire(hex<"FF">), wire(hex<"FF10">), wire(hex<"18">),
                             wire(hex<"0874">), wire(hex<"08">), wire(hex<"ABFF">), wire(hex<"70">)}) {
    Bench bench;
    Wire both = before;
    both.insert(both.end(), {0x08, 0x75});
    const sim::testing::RawHost host = bench.UnitBench::raw(both, 100us, 12us);
    EXPECT_EQ(host.reply.size(), 18u) << int{before[0]} << " " << before.size();
    EXPECT_EQ(host.first_byte_at - host.sent_at, answer_time + 1us) << int{before[0]} << " " << before.size();
  }
}

// The reply of another encoder on the line contains bytes that look like a request for this encoder.
TEST(EslDevice, FindsNoRequestInAnotherEncodersReply) {
  Bench bench;
  const Wire reply = wire({.id = DataId::position_short,
                           .encoder_address = 3,
                           .one = {.status = status::ready},
                           .singleturn = 0x7508,
                           .multiturn = 0x7508});
  Wire both = wire_of({DataId::position_short, 3});
  both.insert(both.end(), reply.begin(), reply.end());
  EXPECT_TRUE(bench.raw(both).empty());
  EXPECT_EQ(bench.raw(wire(hex<"0875">)).size(), 18u);
}

TEST(EslDevice, ReportsWrongParityBitByProfile) {
  for (std::uint8_t address = 0; address < 8; ++address) {
    for (const ParityScope scope : {ParityScope::command, ParityScope::all}) {
      Bench bench({.parity_scope = scope, .address = address});
      Wire wrong = wire_of({DataId::position, address}, bench.profile);
      wrong[0] ^= 0x80;
      wrong[1] = checksum8(CrcBitOrder::lsb, Bytes(wrong).first(1));
      const Wire reply = bench.raw(wrong);
      ASSERT_EQ(reply.size(), 18u) << int{address};
      EXPECT_EQ(reply[0], wrong[0]);
      EXPECT_EQ(reply[11], wrong[0]);
      EXPECT_EQ(reply[1] & status::rejected, status::parity_error);
      EXPECT_EQ(reply[12] & status::rejected, status::parity_error);
      Bench silent({.parity_scope = scope, .address = address, .bad_request = BadRequest::silent});
      EXPECT_TRUE(silent.raw(wrong).empty()) << int{address};
    }
  }
}

// A virtual encoder without a line: the test passes the line's events to it.
struct Alone {
  using LinkEvent = Event<std::uint8_t>::Kind;
  Alone() { encoder.power_on(Time{}, PowerOn::skip); }
  Step<std::uint8_t> feed(LinkEvent kind, Time at, const Wire& bytes = {}) {
    encoder.feed({.kind = kind, .at = at, .items = bytes});
    return encoder.next(at);
  }
  testing::TestShaft shaft;
  VirtualEncoder encoder{{}, shaft};
};
constexpr auto waits = Step<std::uint8_t>::Kind::wait;

// The second character of the request is damaged. The encoder answers only after the time at which the undamaged
// request would have ended.
TEST(EslDevice, ReportsWrongStopBitAfterTheRequest) {
  Alone alone;
  alone.feed(Alone::LinkEvent::received, 1us, {control_field({}, 0, DataId::position)});
  EXPECT_EQ(alone.feed(Alone::LinkEvent::line_error, 2us).kind, waits);
  EXPECT_EQ(alone.feed(Alone::LinkEvent::received, 3us, {0x55}).kind, waits);
  const Step<std::uint8_t> step = alone.feed(Alone::LinkEvent::silence, 3us + 2 * line_settings.character());
  ASSERT_EQ(step.kind, Step<std::uint8_t>::Kind::transfer);
  EXPECT_EQ(step.at, 3us + answer_time);
  EXPECT_EQ(step.out[1] & status::rejected, status::stop_error);
  EXPECT_EQ(alone.encoder.violation_count(), 0u);
}

TEST(EslDevice, AnyPauseEndsReplyOfAbsentEncoder) {
  Alone alone;
  const Step<std::uint8_t> step = alone.feed(Alone::LinkEvent::received, 2us, wire_of({DataId::position, 3}));
  EXPECT_EQ(step.expect, 0u);
  EXPECT_GT(step.gap, Time{});
  alone.feed(Alone::LinkEvent::silence, 5us);
  const Wire own = wire_of({DataId::position});
  alone.encoder.feed({.kind = Alone::LinkEvent::received, .at = 9us, .items = own});
  alone.encoder.power_off(10us);
  EXPECT_EQ(alone.encoder.next(10us).kind, waits);
}

TEST(EslDevice, BadRequestRestartsTheCount) {
  for (const auto kind : {Alone::LinkEvent::received, Alone::LinkEvent::line_error}) {
    Alone alone;
    alone.shaft.put(0, 1'000'000);
    Time now{};
    const Wire zero = wire_of({DataId::zero});
    const auto ask = [&](int times) {
      for (; times > 0; --times) {
        alone.feed(Alone::LinkEvent::received, now += reset_interval, zero);
        alone.feed(Alone::LinkEvent::sent, now + 20us);
      }
    };
    ask(7);
    alone.feed(Alone::LinkEvent::received, now += reset_interval, {zero[0]});
    alone.feed(kind, now + 1us, {0x55});
    alone.feed(Alone::LinkEvent::silence, now + 3us);
    alone.feed(Alone::LinkEvent::sent, now + 20us);
    ask(1);
    EXPECT_EQ(alone.encoder.reply_to(DataId::position, now).singleturn, 1'000'000u);
    ask(7);
    EXPECT_EQ(alone.encoder.reply_to(DataId::position, now).singleturn, 0u);
  }
}

TEST(EslDevice, RequestDuringTransmissionIsOneViolation) {
  Bench bench;
  Wire requests = wire_of({DataId::position});
  const Wire memory = wire_of(memory_write(0x20, 7));
  requests.insert(requests.end(), memory.begin(), memory.end());
  bench.raw(requests);
  EXPECT_EQ(bench.violations(), 1u);
}

TEST(EslDevice, ReadyOnlyAfterStartUp) {
  Bench bench;
  bench.encoder.power_off(Time{});
  EXPECT_TRUE(bench.raw(Request{}).empty());
  const Time on = bench.line.now();
  bench.encoder.power_on(on, PowerOn::real);
  EXPECT_EQ(bench.read().one.status & status::ready, 0);
  EXPECT_EQ(bench.read().two.status & status::ready, 0);
  bench.line.run_until(on + 100ms);
  EXPECT_EQ(bench.read().one.status, status::ready);
  EXPECT_EQ(bench.read().two.status, status::ready | status::channel_2);
}

// ---- Memory

TEST(EslDevice, ReadsRegistersAtOnceAndEepromInTwoSteps) {
  Bench bench;  // page 8, which has registers, is selected after power on
  bench.raw(memory_write(0x05, 0x11));
  EXPECT_EQ(bench.raw(memory_read(0x05)), memory_reply(memory_read(0x05), false, 0x11));
  bench.raw(memory_write(page_select_address, 0));
  bench.pass(18ms);
  EXPECT_EQ(bench.raw(memory_write(5, 0x77)), memory_reply(memory_write(5, 0x77), false, 0x77));
  const Time written = bench.line.now();
  EXPECT_EQ(bench.raw(memory_read(5)), memory_reply(memory_read(5), true, 0));
  bench.line.run_until(written + 5900us);
  EXPECT_EQ(bench.raw(memory_write(6, 1)), memory_reply(memory_write(6, 1), true, 0));
  bench.line.run_until(written + 6ms);
  EXPECT_EQ(bench.raw(memory_read(5)), memory_reply(memory_read(5), true, 0));
  bench.pass(200us);
  EXPECT_EQ(bench.raw(memory_read(5)), memory_reply(memory_read(5), false, 0x77));
  EXPECT_EQ(*bench.encoder.stored(0, 6), 0);  // the memory byte is still 0, because the write was not executed
  EXPECT_EQ(bench.encoder.memory_version(), 1u);
  EXPECT_EQ(bench.violations(), 0u);
  bench.raw(memory_read(7));
  bench.pass(150us);
  EXPECT_EQ(bench.raw(memory_read(7)), memory_reply(memory_read(7), true, 0));
  ASSERT_EQ(bench.violations(), 1u);
  EXPECT_EQ(bench.encoder.violations()[0].rule, "memory read again less than 200 us after the request before");
  bench.pass(eeprom_read_time);
  // The encoder replies that it is busy: it had fetched the byte at address 7 and must first fetch the byte at address
  // 5.
  EXPECT_EQ(bench.raw(memory_read(5)), memory_reply(memory_read(5), true, 0));
}

TEST(EslDevice, PageChangeTakes18Milliseconds) {
  Bench bench;
  bench.raw(memory_write(page_select_address, 4));
  bench.pass(17ms);
  EXPECT_EQ(bench.raw(memory_read(0)), memory_reply(memory_read(0), true, 0));
  ASSERT_EQ(bench.violations(), 1u);
  EXPECT_EQ(bench.encoder.violations()[0].rule, "memory access before the page is ready");
  bench.pass(1ms);
  EXPECT_EQ(bench.raw(memory_read(page_select_address)), memory_reply(memory_read(page_select_address), false, 4));
}

// Some broken rules do not count as violations of the host; the encoder reports them to its RuleWatch only.
TEST(EslDevice, ReportsRulesThatAreNoViolations) {
  using Rules = std::vector<std::string>;
  const std::string once = "an EEPROM byte asked for only once";
  Bench bench;
  author::testing::BrokenRules broken;
  bench.encoder.watch_rules(&broken);
  bench.raw(memory_write(page_select_address, 0));
  bench.pass(page_time);
  bench.raw(memory_read(5));
  bench.pass(1ms);
  bench.raw(memory_read(5));
  EXPECT_EQ(broken.rules, Rules{});
  bench.raw(memory_read(6));
  bench.pass(1ms);
  bench.raw(memory_read(7));
  EXPECT_EQ(broken.rules, Rules{once});
  bench.pass(1ms);
  bench.raw(memory_read(7));
  broken.rules.clear();
  bench.raw(memory_write(5, 1));
  bench.raw(memory_write(6, 1));
  EXPECT_EQ(broken.rules, Rules{"memory written less than 6 ms after the write before"});
  broken.rules.clear();
  bench.reset(DataId::zero, reset_requests - 1);
  bench.raw(Request{DataId::temperature});
  EXPECT_EQ(broken.rules, Rules{"reset not sent eight times in a row"});
}

// If a request is delivered late, the encoder measures the host's pause from its earliest possible arrival to the next
// request.
TEST(EslDevice, TimesCountFromEarliestArrival) {
  const auto rules = [](const Request& first, const Request& second, Time apart, Time late) {
    Alone alone;
    const Wire one = wire_of(first);
    const Wire two = wire_of(second);
    alone.encoder.feed({.kind = Alone::LinkEvent::received, .at = 50ms, .items = one, .late = late});
    alone.encoder.next(50ms);
    alone.feed(Alone::LinkEvent::sent, 50ms);
    alone.feed(Alone::LinkEvent::received, 50ms + apart, two);
    return alone.encoder.violation_count();
  };
  const Request page = memory_write(page_select_address, 4);
  EXPECT_EQ(rules(page, memory_read(0), 12ms, 5ms), 1u);
  EXPECT_EQ(rules(page, memory_read(0), 12ms, 6ms), 0u);
  const Request zero{DataId::zero};
  EXPECT_EQ(rules(zero, zero, 20us, 14us), 1u);
  EXPECT_EQ(rules(zero, zero, 20us, 15us), 0u);
}

TEST(EslDevice, MemorySurvivesPowerOffAndRegistersDoNot) {
  Bench bench;
  bench.raw(memory_write(0x05, 0x11));
  *bench.encoder.stored(14, 0x1F) = 0x22;
  *bench.encoder.stored(6, 0x0B) = 0x33;
  bench.restart();
  EXPECT_EQ(bench.raw(memory_read(0x05))[2], 0);
  EXPECT_EQ(*bench.encoder.stored(14, 0x1F), 0x22);
  EXPECT_EQ(*bench.encoder.stored(6, 0x0B), 0x33);
}

// Every memory byte of Table 11 is stored separately.
TEST(EslDevice, EachAddressHasItsOwnByte) {
  Bench bench;
  std::map<std::uint8_t*, int> seen;
  for (unsigned page = 0; page < 256; ++page) {
    for (unsigned address = 0; address < 128; ++address) {
      std::uint8_t* byte = bench.encoder.stored(static_cast<std::uint8_t>(page), static_cast<std::uint8_t>(address));
      if (byte == nullptr) continue;
      EXPECT_EQ(++seen[byte], 1) << page << " " << address;
    }
  }
  EXPECT_EQ(seen.size(), 6u * 127 + 12 + 48 + 64);
}

// ---- Channels and damage

TEST(EslDevice, FaultsStayInTheirChannel) {
  Bench bench;
  bench.shaft.put(0, 0x800000);
  bench.condition(condition::ch2_stuck, 0);
  bench.condition(condition::ch2_alarms, alarms::singleturn_error);
  const Wire bytes = bench.raw(Request{DataId::alarms});
  EXPECT_EQ(bytes[2], 0);
  EXPECT_EQ(bytes[6], alarms::singleturn_error);
  EXPECT_EQ(bytes[1] & status::safety_error, 0);
  EXPECT_EQ(bytes[5] & status::safety_error, status::safety_error);
  const Reply reply = bench.encoder.reply_to(DataId::position, bench.line.now());
  EXPECT_EQ(reply.singleturn, 0x800000u);
  EXPECT_EQ(reply.redundant, 0u);
}

// The encoder answers a damaged request only if the undamaged characters at its begin address this encoder.
TEST(EslDevice, IgnoresDamagedRequestForAnotherEncoder) {
  using Kind = Event<std::uint8_t>::Kind;
  for (const auto& [begun, is_answered] :
       std::to_array<std::pair<Wire, bool>>({{{control_field({}, 0, DataId::position)}, true},
                                             {{control_field({}, 5, DataId::position)}, false},
                                             {{}, false}})) {
    Bench bench;
    Machine<std::uint8_t>& encoder = bench.encoder;
    encoder.next(1us);
    if (!begun.empty()) encoder.feed({.kind = Kind::received, .at = 1us, .items = begun});
    encoder.feed({.kind = Kind::line_error, .at = 2us});
    encoder.feed({.kind = Kind::silence, .at = 10us});
    EXPECT_EQ(encoder.next(10us).kind == Step<std::uint8_t>::Kind::transfer, is_answered);
  }
}

}  // namespace
}  // namespace absenc::esl
