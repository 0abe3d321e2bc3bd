// SPDX-License-Identifier: Apache-2.0
// Tests that the host verifies each change of an encoder: if the reply is lost, if the encoder ignores the request, and
// if the host does not know the encoder's resolution.
#include <gtest/gtest.h>

#include <algorithm>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/hiperface/fields.hpp"
#include "absenc/protocol/hiperface/unit.hpp"

namespace absenc::hiperface {
namespace {

using author::testing::RunResult;
using author::testing::Talk;
using author::testing::Wire;
using Bench = author::testing::UnitBench<32>;

constexpr std::string_view known = "singleturn_bits=12 multiturn_bits=12";

Wire framed(Wire bytes) {
  bytes.push_back(checksum(bytes));
  return bytes;
}

struct Change {
  std::string_view command;
  std::vector<std::int64_t> arguments;
  std::uint8_t code;  // code of the request that changes the encoder
};
const std::vector<Change> changes{
    {"zero", {}, 0x43},
    {"reset-multiturn", {}, 0x43},
    {"set-position", {0x123456}, 0x43},
    {"count-up", {}, 0x47},
    {"clear-counter", {}, 0x49},
    {"memory-write", {5, 0x7E, 0}, 0x4B},
    {"create-field", {3, 48, 2, 0}, 0x4D},
    {"set-access-code", {1, 0x55, 0x11}, 0x4F},
    {"set-address", {0x47}, 0x55},
    {"set-baud", {38400}, 0x57},
};

// Makes the encoder refuse requests with this command code as unknown, and replaces the refusal by a valid reply. So
// the host believes that the encoder has executed the request.
void ignore(Bench& bench, std::uint8_t code, std::uint8_t subject) {
  bench.tampered.requests([code](unsigned, Wire& received) {
    if (received == Wire{code}) received[0] = 0;
  });
  bench.tampered.replies([=](unsigned, Wire& reply) {
    if (reply[1] != 0xD0) return;
    reply = code == 0x43 || code == 0x47 || code == 0x49 ? framed({0x40, code})
            : code == 0x4B                               ? framed({0x40, code, 0, 5, 1})
                                                         : framed({0x40, code, subject});
  });
}

// After a lost or damaged reply the encoder may still be storing, so the host waits before it reads back.
TEST(HiperfaceChanges, LostOrDamagedReplyIsDecidedByReadingBack) {
  for (const bool lost : {true, false}) {
    for (const Change& change : changes) {
      // no request reads the access code back; after command 4F (change an access code) the host sends a second request
      // 4F, which shows whether the encoder has the new code
      if (change.code == 0x4F) continue;
      SCOPED_TRACE(change.command);
      Bench bench(unit, known);
      bench.shaft.put(9, 0x4000'0000);
      bench.tampered.replies([&](unsigned, Wire& reply) {
        if (reply[1] != change.code) return;
        if (lost) {
          reply.clear();
        } else {
          reply.back() ^= 1;
        }
      });
      const RunResult done = bench.run(change.command, change.arguments);
      EXPECT_EQ(done.error, Error::none) << done.detail;
      EXPECT_GE(done.took, change.code == 0x4D ? 200ms : 250ms);
    }
  }
}
TEST(HiperfaceChanges, IgnoredRequestIsFailureWithoutChange) {
  for (const Change& change : changes) {
    if (change.code == 0x4F) continue;  // the access code (command 4F) cannot be read back
    SCOPED_TRACE(change.command);
    Bench bench(unit, known);
    bench.shaft.put(9, 0x4000'0000);
    bench.run("count-up");  // the counter must not be 0, or else it would not show that the encoder ignored the clear
    ignore(bench, change.code,
           change.code == 0x57 ? 0xE6 : static_cast<std::uint8_t>(change.arguments.empty() ? 0 : change.arguments[0]));
    const Talk<std::uint8_t> talk(unit, bench.options, change.command, change.arguments);
    EXPECT_EQ(bench.run(*talk).error, Error::cross_check_failed);
    const bool shows_no_change = change.code != 0x49;
    EXPECT_EQ(talk->change_sent(), shows_no_change ? ChangeSent::refused : ChangeSent::yes);
  }
}
TEST(HiperfaceChanges, PositionThatWasThereBeforeProvesNothing) {
  for (const bool ignores : {true, false}) {
    Bench bench(unit, "singleturn_bits=12 multiturn_bits=12");
    bench.shaft.put(9, std::int64_t{3} << 20);
    if (ignores) ignore(bench, 0x43, 0);
    const RunResult near = bench.run("zero");
    EXPECT_EQ(near.error, Error::none);
    EXPECT_EQ(near.change, ChangeSent::unproven);
    EXPECT_NE(near.note.find("cannot show whether the encoder obeyed"), std::string::npos) << near.note;
  }
  Bench bench(unit, "singleturn_bits=12 multiturn_bits=12");
  bench.shaft.put(9, std::int64_t{3} << 20);
  EXPECT_EQ(bench.run("reset-multiturn").change, ChangeSent::yes);
}
TEST(HiperfaceChanges, PositionIsComparedInBothDirections) {
  for (const std::int64_t place : {0x4000'0000LL, 0xC000'0000LL}) {
    Bench bench(unit, "singleturn_bits=12 multiturn_bits=0");
    bench.shaft.put(0, place);
    ignore(bench, 0x43, 0);
    EXPECT_EQ(bench.run("zero").error, Error::cross_check_failed) << place;
  }
}
TEST(HiperfaceChanges, HostWithoutResolutionSetsPositionOfTheEncoders) {
  Bench bench(unit, "singleturn_bits=15 multiturn_bits=12");
  bench.shaft.put(9, 0x4000'0000);
  bench.tell("singleturn_bits=0 multiturn_bits=-1");
  EXPECT_EQ(bench.run("zero").error, Error::none);
  EXPECT_EQ(bench.run("position").numbers.at("multiturn"), 9);
  EXPECT_EQ(bench.run("set-position", {0x7000123}).error, Error::none);
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.numbers.at("multiturn"), 0xE00);
  EXPECT_EQ(read.numbers.at("singleturn"), 0x123);
}
TEST(HiperfaceChanges, PositionsBeforeChangeAreTenMillisecondsApart) {
  Bench bench(unit, "singleturn_bits=12 multiturn_bits=12 baud=38400");
  std::vector<Time> asked;
  bench.tampered.requests([&](unsigned, Wire& received) {
    if (received == Wire{0x42}) asked.push_back(bench.line.now());
  });
  ASSERT_EQ(bench.run("zero").error, Error::none);
  ASSERT_GE(asked.size(), 2u);
  const Time character = LineSettings{.rate = 38400, .parity = Parity::even}.character();
  EXPECT_GE(asked[1] - asked[0], 10 * character + answer_time + 10ms);
}
TEST(HiperfaceChanges, PositionThatMayBeInvalidIsNotChanged) {
  Bench bench(unit, known);
  bench.device.raise_alarms(alarm_of(0x1E));
  bench.tampered.replies([](unsigned, Wire& reply) {
    if (reply[1] == 0xD0) reply = framed({0x40, 0xD0, 0x77});  // status code 77 (hex) is in no source
  });
  for (const char* const name : {"zero", "reset-multiturn"}) {
    const Talk<std::uint8_t> talk(unit, bench.options, name);
    EXPECT_EQ(bench.run(*talk).error, Error::invalid_argument) << name;
    EXPECT_EQ(talk->change_sent(), ChangeSent::no) << name;
  }
}
TEST(HiperfaceChanges, BaudRateThatTakesEffectAfterResetIsWaitedFor) {
  Bench bench(unit, known);
  bench.device.raise_alarms(alarm_of(0x1D));  // a reset of the encoder ends the alarm with status code 1D
  ignore(bench, 0x57, 0xE6);
  bench.tampered.replies([](unsigned nth, Wire& reply) {
    if (reply[1] == 0xD0) reply = framed({0x40, 0x57, 0xE6});
    if (nth >= 2 && (reply[1] & 0x7F) == 0x52) reply = framed({0x40, reply[1], 0xE6, reply[3], reply[4], reply[5]});
  });
  const RunResult failed = bench.run("set-baud", {38400});
  EXPECT_EQ(failed.error, Error::cross_check_failed);
  EXPECT_TRUE(failed.says("after a reset")) << failed.detail;
  // The encoder does not answer at the new rate: the host sends two times three requests. In between it resets the
  // encoder, which takes 500 ms.
  EXPECT_GE(failed.took, 800ms);
  bench.tampered.replies({});
  EXPECT_EQ(bench.run("status").numbers.at("alarms"), 0);
}

}  // namespace
}  // namespace absenc::hiperface
