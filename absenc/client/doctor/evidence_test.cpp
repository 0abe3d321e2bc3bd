// SPDX-License-Identifier: Apache-2.0
// Checks that doctor judges an encoder only by sufficient evidence.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absenc/client/doctor/observed_test.hpp"

namespace absenc::client {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

TEST(Doctor, FailuresThatComeAndGoAreToldWithTheirPeriod) {
  const Examination even = examine_contact(5s, [](Time at) { return at % 1s < 300ms; });
  EXPECT_THAT(even.findings.at(0).evidence, AllOf(HasSubstr("bursts of about 3"), HasSubstr("one every 1 s")));
  const Examination uneven = examine_contact(
      6s, [](Time at) { return (at > 1s && at < 1100ms) || (at > 1900ms && at < 2s) || (at > 5s && at < 5100ms); });
  EXPECT_THAT(uneven.findings.at(0).evidence, AllOf(HasSubstr("in 3 bursts"), HasSubstr("at uneven distances")));
  // Failed readings that are independent of each other form no bursts.
  std::mt19937 random(5);
  const Examination any = examine_contact(5s, [&](Time) { return random() % 10 == 0; });
  EXPECT_THAT(ids(any), Contains("sometimes_silent"));
  EXPECT_THAT(ids(any), Not(Contains("comes_and_goes")));
}

TEST(Doctor, AShaftThatFollowsTheHandGivesNoFinding) {
  const auto place = [](std::size_t i) { return i * hand_counts; };
  EXPECT_THAT(ids(judged(turned_by_hand(
                  place, [](std::size_t i) { return static_cast<std::int64_t>(i * hand_counts >> 17); }))),
              IsEmpty());
  const auto less_than_a_turn = [](std::size_t i) {
    return i * 600;
  };  // 200 readings cover 119 400 of the 131 072 counts of a turn
  EXPECT_THAT(ids(judged(turned_by_hand(less_than_a_turn, [](std::size_t) { return 3; }))), IsEmpty());
}

TEST(Doctor, ALatenessOfThisComputerIsNotTheEncoders) {
  Observations seen = positions([](std::size_t) { return 5; });
  for (Attempted& one : seen.readings) one.limit = 3ms;
  seen.late = 4;
  seen.lateness = 15ms;
  EXPECT_THAT(ids(judged(seen)), Contains("sometimes_late"));
  seen.computer_late = 11ms;
  EXPECT_THAT(ids(judged(seen)), Contains("sometimes_late"));
  seen.computer_late = 13ms;
  EXPECT_THAT(ids(judged(seen)), IsEmpty());
  // A single late reply may come from a delay of this computer, not of the encoder.
  seen.readings.resize(10);
  EXPECT_THAT(ids(judged(seen)), Contains("reply_late"));
  seen.late = 1;
  EXPECT_THAT(ids(judged(seen)), IsEmpty());
  seen.computer_late = 11ms;
  EXPECT_THAT(ids(judged(seen)), Contains("reply_late"));
}

TEST(Doctor, FewOfThousandsMayBeABusyComputer) {
  Observations seen = positions([](std::size_t) { return 5; });
  const std::vector<Attempted> some = seen.readings;
  while (seen.readings.size() < 4000) seen.readings.insert(seen.readings.end(), some.begin(), some.end());
  for (std::size_t i = 0; i < seen.readings.size(); ++i) {
    seen.readings[i].reading->latched = static_cast<std::int64_t>(i) * 1ms;
  }
  seen.lateness = 30ms;
  for (const std::size_t few : {3, 4}) {
    for (const Time computer_late : {Time{100us}, Time{2ms}}) {
      SCOPED_TRACE(few);
      const bool is_told = few == 4 || computer_late < 1ms;
      seen.computer_late = computer_late;
      seen.late = few;
      EXPECT_EQ(ids(judged(seen)), is_told ? std::vector<std::string>{"sometimes_late"} : std::vector<std::string>{});
      Observations silent = seen;
      silent.late = 0;
      for (std::size_t i = 0; i < few; ++i) silent.readings[100 * i] = {.error = Error::timeout};
      EXPECT_EQ(ids(judged(silent)),
                is_told ? std::vector<std::string>{"sometimes_silent"} : std::vector<std::string>{});
    }
  }
}

TEST(Doctor, OneOfManyMayBeABusyComputer) {
  const auto with_one = [](std::size_t count, const Attempted& failed) {
    Observations seen = positions([](std::size_t) { return 5; });
    seen.readings.resize(count);
    seen.readings[count / 2] = failed;
    return seen;
  };
  Attempted late_and_next{.error = Error::wrong_length, .heard = true, .answered = true};
  late_and_next.exchange.request.bytes = {0x1A};
  late_and_next.exchange.reply.bytes = good_reply();
  late_and_next.exchange.reply.bytes.insert(late_and_next.exchange.reply.bytes.end(), good_reply().begin(),
                                            good_reply().end());
  late_and_next.raw = late_and_next.exchange.reply.bytes;
  for (const auto& [failed, id] : {std::pair<Attempted, std::string>{{.error = Error::timeout}, "sometimes_silent"},
                                   {late_and_next, "extra_bytes"}}) {
    Observations few = with_one(3, failed);
    few.computer_late = 2ms;
    EXPECT_THAT(ids(judged(few)), Not(IsEmpty()));
    Observations many = with_one(200, failed);
    EXPECT_THAT(ids(judged(many)), Contains(id));
    many.computer_late = 2ms;
    EXPECT_THAT(ids(judged(many)), IsEmpty());
    EXPECT_THAT(judged(many).verdict(), HasSubstr("(1 failed; this computer itself was up to 2 ms late)"));
  }
  // A single byte after a reply is no late reply, so a busy computer does not explain it.
  Attempted noise = late_and_next;
  noise.exchange.reply.bytes.resize(good_reply().size() + 1);
  noise.raw = noise.exchange.reply.bytes;
  Observations busy = with_one(200, noise);
  busy.computer_late = 2ms;
  EXPECT_THAT(ids(judged(busy)), Contains("extra_bytes"));
}

TEST(Doctor, AComputerThatStoodStillExplainsSilence) {
  Observations seen = positions([](std::size_t) { return 5; });
  const std::vector<Attempted> some = seen.readings;
  seen.readings.insert(seen.readings.end(), some.begin(), some.begin() + 100);
  for (std::size_t i = 0; i < seen.readings.size(); ++i) {
    seen.readings[i].reading->latched = static_cast<std::int64_t>(i) * 1ms;
    seen.readings[i].limit = 300ms;
  }
  for (const std::size_t place : {100, 101}) seen.readings[place] = {.error = Error::timeout, .limit = 300ms};
  seen.computer_late = 74ms;
  EXPECT_THAT(ids(judged(seen)), Contains("sometimes_silent"));
  seen.computer_late = 75ms;
  EXPECT_THAT(ids(judged(seen)), IsEmpty());
  Observations quick = seen;
  for (Attempted& one : quick.readings) one.limit = 40ms;
  quick.computer_late = 39ms;
  EXPECT_THAT(ids(judged(quick)), Contains("sometimes_silent"));
  quick.computer_late = 40ms;
  EXPECT_THAT(ids(judged(quick)), IsEmpty());
  seen.readings[102] = seen.readings[100];
  EXPECT_THAT(ids(judged(seen)), Contains("sometimes_silent"));
}

/// A computer that reads late may cut a reply, but it does not change bytes.
TEST(Doctor, AComputerThatStoodStillExplainsACutReply) {
  Observations seen = positions([](std::size_t) { return 5; });
  for (Attempted& one : seen.readings) one.exchange.reply.bytes = good_reply();
  Attempted cut{.error = Error::wrong_length, .heard = true, .answered = true, .limit = 300ms};
  cut.exchange.request.bytes = {0x1A};
  cut.exchange.reply.bytes = good_reply();
  cut.exchange.reply.bytes.pop_back();
  cut.raw = cut.exchange.reply.bytes;
  seen.readings[100] = cut;
  EXPECT_THAT(ids(judged(seen)), Not(IsEmpty()));
  seen.computer_late = 2ms;
  EXPECT_THAT(ids(judged(seen)), IsEmpty());
  seen.readings[100].exchange.reply.bytes.push_back(0x55);
  seen.readings[100].raw = seen.readings[100].exchange.reply.bytes;
  seen.readings[100].error = Error::bad_checksum;
  EXPECT_THAT(ids(judged(seen)), Not(IsEmpty()));
}

/// A checksum misses some damaged replies, which then look like replies to other requests.
TEST(Doctor, OneReplyToAnotherRequestAmongManyDamagedBlamesNoRequest) {
  for (const std::size_t damaged : {5U, 40U}) {
    Observations seen = positions([](std::size_t) { return 5; });
    const auto spoil = [&](std::size_t at, Error error, const ByteList& reply) {
      seen.readings[at].error = error;
      seen.readings[at].reading.reset();
      seen.readings[at].raw = reply;
      seen.readings[at].exchange.request.bytes = {0x1A};
      seen.readings[at].exchange.reply.bytes = reply;
    };
    for (std::size_t i = 0; i < damaged; ++i) {
      ByteList reply = good_reply();
      reply[2 + i % 8] ^= static_cast<std::uint8_t>(1 << i % 7);
      spoil(4 * i + 1, Error::bad_checksum, reply);
    }
    spoil(190, Error::unexpected_reply, {0x02, 0, 0, 0, 0, 0x02});
    const std::vector<std::string> found = ids(judged(seen));
    EXPECT_EQ(std::ranges::count(found, "requests_damaged"), damaged == 5 ? 1 : 0) << damaged;
  }
}

TEST(Doctor, FewReadingsAreNotGood) {
  Observations seen = positions([](std::size_t) { return 5; });
  seen.readings.resize(10);
  EXPECT_TRUE(judged(seen).healthy());
  for (const std::size_t few : {9, 3, 1}) {
    seen.readings.resize(few);
    const Examination examination = judged(seen);
    EXPECT_EQ(ids(examination), std::vector<std::string>{"few_readings"});
    EXPECT_FALSE(examination.healthy());
    EXPECT_THAT(examination.verdict(), AllOf(StartsWith("first: few_readings: "), HasSubstr("--for 30")));
    EXPECT_THAT(examination.findings[0].evidence, StartsWith("only " + std::to_string(few) + " reading"));
  }
  EXPECT_THAT(judged({}).verdict(), Not(StartsWith("good")));
  seen.complete = false;
  EXPECT_THAT(ids(judged(seen)), IsEmpty());
}

/// Examines a device that sends good replies by itself and takes no request.
Examination examine_sender(Time period) {
  const Surroundings surroundings{[&](const EncoderAddress&) {
                                    auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
                                    port->babble = good_reply();
                                    port->babble_period = period;
                                    port->latency = 300ms;
                                    return link_to(std::move(port));
                                  },
                                  [](const std::string&) { return os::PortFacts{}; }};
  return examine(parse_address(serial), {.limit = 5s}, surroundings);
}

TEST(Doctor, ADeviceThatTakesNoRequestIsNotGood) {
  for (const Time period : {Time(2ms), Time(10ms), Time(30ms), Time(45ms), Time(170ms)}) {
    const Examination examination = examine_sender(period);
    EXPECT_GT(examination.good, 10u) << "its frames pass for replies";
    EXPECT_THAT(ids(examination), Contains("never_silent")) << to_json(examination).line();
    EXPECT_FALSE(examination.healthy());
  }
}

TEST(Doctor, ALateReplyBeforeTheFirstRequestIsNoSender) {
  const Surroundings surroundings{[&](const EncoderAddress&) {
                                    auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
                                    port->answer = [](const ByteList&) { return good_reply(); };
                                    port->babble = good_reply();
                                    port->babble_period = 24h;
                                    return link_to(std::move(port));
                                  },
                                  [](const std::string&) { return os::PortFacts{}; }};
  EXPECT_THAT(ids(examine(parse_address(serial), {.readings = 100}, surroundings)), IsEmpty());
}

TEST(Doctor, GoodSaysHowMuchWasLookedAt) {
  const Examination good = examine_contact(2s, [](Time) { return false; });
  EXPECT_TRUE(good.healthy());
  EXPECT_GT(good.tried, 1000u);
  EXPECT_THAT(good.verdict(), AllOf(HasSubstr(" in 2 s"), HasSubstr("95 %: less than 0."),
                                    HasSubstr("not looked at: a turning shaft")));
  EXPECT_LT(good.measured.failures, 4.0 / static_cast<double>(good.tried));
  EXPECT_GE(good.measured.time, 1900ms);
}

TEST(Doctor, NothingIsCalledGoodOfWhichNothingWas) {
  for (const Error error : {Error::timeout, Error::bad_checksum, Error::wrong_length, Error::unexpected_reply}) {
    for (const bool heard : {false, true}) {
      for (const std::size_t late : {0, 1, 30}) {
        Observations seen = positions([](std::size_t) { return 5; });
        for (Attempted& one : seen.readings) one = {.error = error, .heard = heard};
        seen.late = late;
        seen.lateness = 5ms;
        seen.computer_late = 10ms;
        EXPECT_THAT(judged(seen).verdict(), Not(StartsWith("good"))) << heard << " " << late;
        EXPECT_FALSE(judged(seen).healthy());
      }
    }
  }
}

TEST(Doctor, RepeatedRequestsShowAdapter) {
  Observations seen = positions([](std::size_t) { return 5; });
  for (std::uint8_t i = 0; i < 20; ++i) {
    ByteList reply = good_reply();
    reply[2] = 0xFF;
    reply[3] = i;
    reply.back() = static_cast<std::uint8_t>(reply.back() ^ 0xFF ^ i);
    reply.insert(reply.begin() + 2, 0xFF);
    Attempted one{.error = Error::wrong_length, .raw = reply, .heard = true, .answered = true};
    one.exchange.request.bytes = {0x1A};
    one.exchange.reply.bytes = reply;
    seen.repeated.push_back(one);
  }
  EXPECT_THAT(ids(judged(seen)), Contains("telnet_doubled"));
}

// A bit is sampled half a period behind the edge that changes it, on a line that turns a whole one. BiSS finds its
// start bit behind a way of any length.
TEST(Doctor, FailingClockShowsTheWayWhereTheBitsHaveNoStartBit) {
  for (const auto& [unit, way] : std::vector<std::pair<std::string, std::string>>{
           {"ssi", "the way takes 333 to 500 ns"},
           {"endat?model=ECN-1325", "the way takes 666 to 1000 ns"},
           {"biss", "encoder, transceivers or cable are too slow for 1500000 Hz"}}) {
    SCOPED_TRACE(unit);
    const EncoderAddress address = parse_address("sim:" + unit);
    Observations seen = positions([](std::size_t) { return 5; });
    seen.clocks = {{500'000, 5, 5}, {1'000'000, 5, 5, true}, {1'500'000, 0, 5}};
    const Examination too_fast = judge(*address.unit, address.options, seen);
    ASSERT_EQ(ids(too_fast), std::vector<std::string>{"clock_range"});
    EXPECT_THAT(too_fast.findings[0].cause, HasSubstr(way));
    EXPECT_THAT(too_fast.findings[0].action, HasSubstr("set speed=1000000 or less"));
    EXPECT_TRUE(too_fast.healthy());
    seen.clocks.pop_back();
    const Examination none_failed = judge(*address.unit, address.options, seen);
    ASSERT_EQ(ids(none_failed), std::vector<std::string>{"clock_range"});
    EXPECT_EQ(none_failed.findings[0].action, "keep the clock");
  }
}

TEST(Doctor, OnesAloneAreNoPositionOfWhichToBeSure) {
  const EncoderAddress address = parse_address("sim:ssi");
  const auto examined = [&](std::uint8_t last, std::optional<bool> driven) {
    Observations seen = positions([](std::size_t) { return 5; }, 12);
    for (Attempted& one : seen.readings) {
      one.raw = one.exchange.reply.bytes = {0xFF, 0xF0};  // the last four bits are no part of the 12 of the word
      one.exchange.reply.bits = 12;
    }
    seen.readings.back().raw.back() = last;
    seen.data_driven = driven;
    return ids(judge(*address.unit, address.options, seen));
  };
  EXPECT_EQ(examined(0xF0, {}), std::vector<std::string>{"data_at_rest"});
  EXPECT_EQ(examined(0xF0, true), std::vector<std::string>{"data_at_rest"});
  EXPECT_EQ(examined(0xF0, false), std::vector<std::string>{"transceiver_missing"});
  // A single bit that is 0 shows that something sends.
  EXPECT_THAT(examined(0xE0, {}), IsEmpty());
  EXPECT_THAT(examined(0xE0, false), IsEmpty());
}

}  // namespace absenc::client
