// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/hiperface/fields.hpp"
#include "absenc/protocol/hiperface/unit.hpp"

namespace absenc::hiperface {
namespace {

using author::testing::RunResult;
using author::testing::Wire;
using Bench = author::testing::UnitBench<32>;

// Options that state the resolution, so that the host does not read the type label first.
constexpr std::string_view known = "singleturn_bits=12 multiturn_bits=12";

Wire framed(Wire bytes) {
  bytes.push_back(checksum(bytes));
  return bytes;
}
// Makes the encoder refuse requests with this command as unknown, and replaces its refusals by the frame
// `acknowledged`. The encoder receives a request in pieces of one byte.
void ignore(Bench& bench, std::uint8_t command, const Wire& acknowledged) {
  bench.tampered.requests([command](unsigned, Wire& received) {
    if (received == Wire{command}) received[0] = 0;
  });
  bench.tampered.replies([acknowledged](unsigned, Wire& reply) {
    if (reply[1] == 0xD0) reply = framed(acknowledged);
  });
}
std::uint32_t bit_of(std::string_view alarm) {
  for (std::size_t i = 0; i < alarms.size(); ++i) {
    if (alarms[i].name == alarm) return 1u << i;
  }
  return 0;
}

// ---- Position and alarms

TEST(HiperfaceProcedures, ReadsPositionAndTurnsWithOneRequest) {
  Bench bench(unit, known);
  bench.shaft.put(7, 0x4000'0000);
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.frames, 1u);
  EXPECT_EQ(read.numbers.at("singleturn"), 1024);
  EXPECT_EQ(read.numbers.at("multiturn"), 7);
  EXPECT_EQ(read.reading->alarms_reported, all_alarms);
}
TEST(HiperfaceProcedures, ReadsResolutionFromTypeLabelOrDescription) {
  for (const auto& [options, frames] :
       {std::pair{"singleturn_bits=15 multiturn_bits=0", 2u}, std::pair{"singleturn_bits=17 multiturn_bits=3", 3u}}) {
    Bench bench(unit, options);
    bench.shaft.put(0, 0x4000'0000);
    const auto own = bench.run("position");
    bench.tell("singleturn_bits=0 multiturn_bits=-1");
    const RunResult read = bench.run("position");
    EXPECT_EQ(read.error, Error::none) << options;
    EXPECT_EQ(read.frames, frames) << options;
    EXPECT_EQ(read.reading->singleturn_bits, own.reading->singleturn_bits);
    EXPECT_EQ(read.reading->multiturn_bits, own.reading->multiturn_bits);
    EXPECT_EQ(read.reading->singleturn, own.reading->singleturn);
  }
}
TEST(HiperfaceProcedures, TypeThatDoesNotShowResolutionNeedsOptions) {
  Bench bench(unit, "singleturn_bits=12 multiturn_bits=12 type=0x82");
  EXPECT_EQ(bench.run("position").error, Error::none);
  bench.tell("singleturn_bits=0 multiturn_bits=-1");
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.error, Error::unsupported);
  EXPECT_NE(read.advice.find("singleturn_bits"), std::string::npos);
}
TEST(HiperfaceProcedures, OptionsOfAnotherResolutionContradictTypeLabel) {
  Bench bench(unit, known);
  bench.tell("singleturn_bits=12 multiturn_bits=0");
  const RunResult info = bench.run("info");
  EXPECT_EQ(info.error, Error::unexpected_reply);
  EXPECT_TRUE(info.says("another resolution"));
  EXPECT_EQ(bench.run("scan").error, Error::none);
}
TEST(HiperfaceProcedures, EncoderWithoutTurnsCannotResetThem) {
  Bench bench(unit, "singleturn_bits=12 multiturn_bits=0");
  bench.tell("singleturn_bits=0 multiturn_bits=-1");
  EXPECT_EQ(bench.run("reset-multiturn").error, Error::unsupported);
}
TEST(HiperfaceProcedures, ReadsStatusUntilACodeComesAgain) {
  Bench bench(unit, known);
  bench.device.raise_alarms(bit_of("led_current") | bit_of("over_speed") | bit_of("multiturn_position_2"));
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.frames, 5u);  // frames: the position, three status codes, the first status code again
  EXPECT_EQ(read.reading->alarms, bit_of("led_current") | bit_of("over_speed") | bit_of("multiturn_position_2"));
  EXPECT_EQ(read.reading->alarms_reported, read.reading->alarms);
  EXPECT_EQ(read.reading->singleturn_validity(), Validity::invalid);
  EXPECT_EQ(read.reading->multiturn_validity(), Validity::invalid);
}
TEST(HiperfaceProcedures, WarningLeavesPositionValid) {
  Bench bench(unit, "");
  bench.condition(0, 120);
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.reading->alarms, bit_of("temperature"));
  EXPECT_EQ(read.reading->singleturn_validity(), Validity::valid);
  EXPECT_EQ(read.reading->multiturn_validity(), Validity::valid);
  bench.condition(0, 115);
  EXPECT_EQ(bench.run("position").reading->alarms, 0u);
  EXPECT_EQ(bench.run("temperature").numbers.at("temperature_c"), 115);
}
TEST(HiperfaceProcedures, CodeThatNoSourceExplainsLeavesPositionUnknown) {
  Bench bench(unit, "");
  bench.device.raise_alarms(bit_of("over_speed"));
  bench.tampered.replies([](unsigned, Wire& reply) {
    if (reply[1] == 0xD0) reply = framed({0x40, 0xD0, 0x77});
  });
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.error, Error::none);
  EXPECT_EQ(read.reading->singleturn_validity(), Validity::unknown);
  EXPECT_EQ(read.numbers.at("status_code"), 0x77);
}
TEST(HiperfaceProcedures, CodeThatNoSourceExplainsLeavesNoPartValid) {
  Bench bench(unit, known);
  bench.device.raise_alarms(bit_of("multiturn_position_1"));
  bench.tampered.replies([](unsigned nth, Wire& reply) {
    if (nth == 2) reply = framed({0x40, 0xD0, 0x77});
  });
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.reading->alarms, bit_of("multiturn_position_1"));
  EXPECT_EQ(read.reading->singleturn_validity(), Validity::unknown);
  EXPECT_EQ(read.reading->multiturn_validity(), Validity::invalid);
}
TEST(HiperfaceProcedures, ErrorBitWithoutAlarmIsReadAgain) {
  Bench bench(unit, known);
  bench.tampered.replies([](unsigned nth, Wire& reply) {
    if (nth > 0) return;
    reply[1] |= error_bit;
    reply.back() ^= error_bit;
  });
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.frames, 3u);  // frames: a position with the error bit, status 00, a position
  EXPECT_EQ(read.reading->singleturn_validity(), Validity::valid);
  EXPECT_EQ(read.reading->status, 0u);
}
TEST(HiperfaceProcedures, StatusOfHealthyEncoderIsNoError) {
  Bench bench(unit, "");
  const RunResult read = bench.run("status");
  EXPECT_EQ(read.numbers.at("status_code"), 0);
  EXPECT_EQ(read.texts.at("status_text"), "no error");
  EXPECT_EQ(read.numbers.at("alarms"), 0);
}

// ---- Setting the position

TEST(HiperfaceProcedures, ZeroLeavesTurns) {
  Bench bench(unit, "");
  bench.shaft.put(9, 0x1234'5678);
  EXPECT_EQ(bench.run("zero").error, Error::none);
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.numbers.at("singleturn"), 0);
  EXPECT_EQ(read.numbers.at("multiturn"), 9);
}
TEST(HiperfaceProcedures, ResetMultiturnLeavesPositionWithinTurn) {
  Bench bench(unit, "");
  bench.shaft.put(9, 0x4000'0000);
  EXPECT_EQ(bench.run("reset-multiturn").error, Error::none);
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.numbers.at("singleturn"), 1024);
  EXPECT_EQ(read.numbers.at("multiturn"), 0);
  Bench single(unit, "multiturn_bits=0");
  EXPECT_EQ(single.run("reset-multiturn").error, Error::unsupported);
}
TEST(HiperfaceProcedures, SetPositionSurvivesPowerOff) {
  Bench bench(unit, "");
  bench.shaft.put(9, 0x4000'0000);
  EXPECT_EQ(bench.run("set-position", {0xABC123}).error, Error::none);
  bench.restart(Bench::PowerOn::skip);
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.numbers.at("singleturn"), 0x123);
  EXPECT_EQ(read.numbers.at("multiturn"), 0xABC);
  EXPECT_EQ(bench.run("set-position", {0x1000000}).error, Error::invalid_argument);
}
TEST(HiperfaceProcedures, RefusesToSetPositionOfTurningShaft) {
  Bench bench(unit, known);
  bench.shaft.spin(60, bench.line.now());
  for (const std::string_view name : {"zero", "reset-multiturn", "set-position"}) {
    const RunResult refused =
        bench.run(name, name == "set-position" ? std::vector<std::int64_t>{1} : std::vector<std::int64_t>{});
    EXPECT_EQ(refused.error, Error::not_still) << name;
    EXPECT_EQ(refused.frames, 2u) << name;
  }
}
TEST(HiperfaceProcedures, RefusesZeroWithoutValidTurnsThatItWouldStore) {
  Bench bench(unit, "");
  bench.device.raise_alarms(bit_of("multiturn_position_1"));
  EXPECT_EQ(bench.run("zero").error, Error::invalid_argument);
  EXPECT_EQ(bench.run("reset-multiturn").error, Error::none);
}
TEST(HiperfaceProcedures, PositionThatIsAnotherOneAfterwardsIsFailure) {
  Bench bench(unit, "");
  bench.shaft.put(0, 0x4000'0000);
  ignore(bench, 0x43, {0x40, 0x43});
  EXPECT_EQ(bench.run("zero").error, Error::cross_check_failed);
}
TEST(HiperfaceProcedures, WrongCode0IsRefusedInWords) {
  Bench bench(unit, "");
  bench.tell("code0=0x54");
  const RunResult refused = bench.run("zero");
  EXPECT_EQ(refused.error, Error::request_rejected);
  EXPECT_TRUE(refused.says("0F: the access code is wrong")) << refused.detail;
  EXPECT_TRUE(refused.says("nothing was changed")) << refused.detail;
}

// ---- Counter and reset

TEST(HiperfaceProcedures, CounterCountsWrapsAndIsCleared) {
  Bench bench(unit, "counter_bytes=1");
  for (int i = 1; i <= 255; ++i) ASSERT_EQ(bench.run("count-up").numbers.at("counter"), i);
  EXPECT_EQ(bench.run("count-up").numbers.at("counter"), 0);
  EXPECT_EQ(bench.run("position").reading->alarms, bit_of("counter_overflow"));
  EXPECT_EQ(bench.run("count-up").numbers.at("counter"), 1);
  EXPECT_EQ(bench.run("clear-counter").error, Error::none);
  EXPECT_EQ(bench.run("counter").numbers.at("counter"), 0);
  EXPECT_EQ(bench.run("position").reading->alarms, 0u);
}
TEST(HiperfaceProcedures, ExplainsLengthOnlyIfItIsWrong) {
  Bench bench(unit, known);
  bench.tampered.replies([](unsigned, Wire& reply) { reply.back() ^= 1; });
  EXPECT_EQ(bench.run("counter").error, Error::bad_checksum);
  EXPECT_FALSE(bench.run("counter").says("length"));
  bench.tampered.replies([](unsigned, Wire& reply) { reply.push_back(0); });
  EXPECT_TRUE(bench.run("counter").says("the counter may have another length"));
}
TEST(HiperfaceProcedures, ResetWaitsUntilEncoderAnswers) {
  Bench bench(unit, known);
  bench.shaft.put(3, 0x4000'0000);
  const RunResult reset = bench.run("reset");
  EXPECT_EQ(reset.error, Error::none);
  EXPECT_GT(reset.took, 250ms);
  EXPECT_EQ(reset.frames, 4u);  // frames: position, reset, type label, position
  EXPECT_EQ(reset.numbers.at("multiturn"), 3);
  bench.tampered.replies([](unsigned nth, Wire& reply) {
    if (nth > 0) reply.clear();
  });
  const RunResult lost = bench.run("reset");
  EXPECT_EQ(lost.error, Error::timeout);
  EXPECT_TRUE(lost.says("does not answer since"));
  EXPECT_GE(lost.took, 2s);
}

// ---- Data fields

TEST(HiperfaceProcedures, ReadsWholeDataFieldInPieces) {
  Bench bench(unit, "");
  for (const std::int64_t address : {0, 31, 32, 127}) {
    EXPECT_EQ(bench.run("memory-write", {address, address + 100, 0}).error, Error::none);
  }
  const RunResult read = bench.run("memory-read", {0, 0, 128});
  EXPECT_EQ(read.frames, 4u);
  ASSERT_EQ(read.texts.at("data").size(), 128u);
  for (const std::size_t address : {0u, 31u, 32u, 127u}) {
    EXPECT_EQ(static_cast<std::uint8_t>(read.texts.at("data")[address]), address + 100);
  }
}
TEST(HiperfaceProcedures, WritesByteOnlyIfItDiffers) {
  Bench bench(unit, "");
  EXPECT_EQ(bench.run("memory-write", {5, 0x7E, 0}).numbers.at("written"), 1);
  const RunResult again = bench.run("memory-write", {5, 0x7E, 0});
  EXPECT_EQ(again.numbers.at("written"), 0);
  EXPECT_EQ(again.frames, 1u);
}
TEST(HiperfaceProcedures, EchoOfRequestIsNoReplyToReadingByte) {
  Bench bench(unit, "");
  bench.tampered.replies([](unsigned, Wire& reply) { reply = framed({0x40, 0x4A, 0, 4, 2, 0x55}); });
  EXPECT_NE(bench.run("memory-read", {5, 0, 1}).error, Error::none);
  bench.tampered.replies([](unsigned, Wire& reply) { reply = framed({0x40, 0x4A, 0, 5, 1, 0x55}); });
  EXPECT_NE(bench.run("memory-read", {5, 0, 1}).error, Error::none);
}
TEST(HiperfaceProcedures, ByteThatReadsBackDifferentIsFailure) {
  Bench bench(unit, "");
  ignore(bench, 0x4B, {0x40, 0x4B, 0, 5, 1});
  EXPECT_EQ(bench.run("memory-write", {5, 0x7E, 0}).error, Error::cross_check_failed);
}
TEST(HiperfaceProcedures, RefusesBytesThatDoNotExist) {
  Bench bench(unit, "");
  for (const auto& arguments : {std::vector<std::int64_t>{0, 14, 1}, {120, 0, 9}, {0, 255, 11}, {10, 255, 1}}) {
    const RunResult refused = bench.run("memory-read", arguments);
    EXPECT_EQ(refused.error, Error::invalid_argument);
    EXPECT_EQ(refused.frames, 0u);
  }
  EXPECT_EQ(bench.run("memory-write", {0, 1, 255}).error, Error::invalid_argument);
  const RunResult absent = bench.run("memory-read", {0, 3, 1});
  EXPECT_EQ(absent.error, Error::request_rejected);
  EXPECT_TRUE(absent.says("12: the data field does not exist"));
}
TEST(HiperfaceProcedures, CreatesDataFieldOnce) {
  Bench bench(unit, "");
  EXPECT_EQ(bench.run("free-memory").numbers.at("free_memory"), 12 * 128);
  const RunResult created = bench.run("create-field", {3, 48, 2, 0});
  EXPECT_EQ(created.error, Error::none) << created.detail;
  EXPECT_GE(created.took, create_time);
  EXPECT_EQ(bench.run("free-memory").numbers.at("free_memory"), 12 * 128 - 48);
  const RunResult status = bench.run("field-status", {3});
  EXPECT_EQ(status.numbers.at("size"), 48);
  EXPECT_EQ(status.numbers.at("number"), 2);
  EXPECT_EQ(status.numbers.at("writable"), 0);
  EXPECT_EQ(bench.run("create-field", {3, 48, 2, 0}).numbers.at("written"), 0);
  EXPECT_TRUE(bench.run("create-field", {3, 64, 2, 0}).says("10: the size"));
  EXPECT_TRUE(bench.run("memory-write", {0, 1, 3}).says("0E: the data field must not be written"));
  EXPECT_EQ(bench.run("memory-read", {47, 3, 1}).error, Error::none);
  EXPECT_TRUE(bench.run("memory-read", {47, 3, 2}).says("11: the address is outside"));
  EXPECT_EQ(bench.run("create-field", {4, 17, 0, 1}).error, Error::invalid_argument);
}
TEST(HiperfaceProcedures, ChangedAccessCodeProtectsDataField) {
  Bench bench(unit, "");
  EXPECT_EQ(bench.run("set-access-code", {1, 0x55, 0x11}).error, Error::none);
  EXPECT_TRUE(bench.run("memory-read", {0, 0, 1}).says("0F: the access code is wrong"));
  bench.tell("access_code=0x11");
  EXPECT_EQ(bench.run("memory-read", {0, 0, 1}).error, Error::none);
  EXPECT_EQ(bench.run("set-access-code", {1, 0x55, 0x22}).error, Error::request_rejected);
}
TEST(HiperfaceProcedures, AccessCodeThatStaysIsFailure) {
  Bench bench(unit, "");
  bench.tampered.replies([](unsigned nth, Wire& reply) {
    if (nth == 0) reply = framed({0x40, 0x4F, 1});  // a valid reply replaces the encoder's refusal
  });
  EXPECT_EQ(bench.run("set-access-code", {1, 0x54, 0x11}).error, Error::cross_check_failed);
}

// ---- Identity and settings

TEST(HiperfaceProcedures, InfoReadsTypeLabelAndTexts) {
  Bench bench(unit, "singleturn_bits=9 type=0x47");
  const RunResult info = bench.run("info");
  EXPECT_EQ(info.numbers.at("type"), 0x47);
  EXPECT_EQ(info.texts.at("type_name"), "SEL");
  EXPECT_EQ(info.numbers.at("memory_size"), 2048);
  EXPECT_EQ(info.numbers.at("baud"), 9600);
  EXPECT_EQ(info.texts.at("serial_number"), "VIRTUAL01");
  EXPECT_EQ(info.texts.at("version").size(), 28u);
}
TEST(HiperfaceProcedures, InfoReadsDescriptionOfTypeThatNeedsIt) {
  Bench bench(unit, "singleturn_bits=15 type=0xFF");
  const RunResult info = bench.run("info");
  EXPECT_EQ(info.numbers.at("periods"), 1024);
  EXPECT_EQ(info.numbers.at("range"), 4096);
}
TEST(HiperfaceProcedures, TextsOfAnotherLengthNameTheirOptions) {
  Bench bench(unit, "");
  bench.tell("version_bytes=20");
  const RunResult info = bench.run("info");
  EXPECT_EQ(info.error, Error::wrong_length);
  EXPECT_NE(info.advice.find("version_bytes"), std::string::npos);
}
TEST(HiperfaceProcedures, SetAddressMovesEncoder) {
  Bench bench(unit, "");
  EXPECT_EQ(bench.run("set-address", {0x47}).numbers.at("new_address"), 0x47);
  EXPECT_EQ(bench.run("position").error, Error::timeout);
  EXPECT_EQ(bench.run("address").numbers.at("new_address"), 0x47);
  bench.tell("address=0x47");
  EXPECT_EQ(bench.run("position").error, Error::none);
  EXPECT_EQ(bench.run("set-address", {0x47}).numbers.at("written"), 0);
  bench.restart();
  EXPECT_EQ(bench.run("position").error, Error::none);
}
TEST(HiperfaceProcedures, SetAddressThatIsTakenChangesNothing) {
  Bench bench(unit, "");
  bench.tampered.requests([](unsigned, Wire& received) {
    // makes the encoder also answer requests to the address 47, as if another encoder had it
    if (received == Wire{0x47}) received[0] = 0x40;
  });
  const RunResult refused = bench.run("set-address", {0x47});
  EXPECT_EQ(refused.error, Error::invalid_argument);
  EXPECT_EQ(refused.frames, 2u);
}
TEST(HiperfaceProcedures, AddressThatStaysIsFailure) {
  Bench bench(unit, "");
  ignore(bench, 0x55, {0x40, 0x55, 0x47});
  const RunResult failed = bench.run("set-address", {0x47});
  EXPECT_EQ(failed.error, Error::cross_check_failed);
  EXPECT_TRUE(failed.says("still has its old address"));
}
TEST(HiperfaceProcedures, SetBaudChangesEncoderAndLine) {
  Bench bench(unit, "");
  const RunResult set = bench.run("set-baud", {38400});
  EXPECT_EQ(set.error, Error::none) << set.detail;
  EXPECT_EQ(set.numbers.at("interface"), 0xE6);
  bench.tell("baud=38400");
  EXPECT_EQ(bench.run("baud").numbers.at("baud"), 38400);
  EXPECT_EQ(bench.run("set-baud", {38400}).numbers.at("written"), 0);
  EXPECT_EQ(bench.run("set-baud", {9601}).error, Error::invalid_argument);
}
TEST(HiperfaceProcedures, BaudThatStaysIsFailureAndLineHasItsOldRate) {
  Bench bench(unit, "");
  ignore(bench, 0x57, {0x40, 0x57, 0xE6});
  const RunResult failed = bench.run("set-baud", {38400});
  EXPECT_EQ(failed.error, Error::cross_check_failed);
  EXPECT_TRUE(failed.says("still has its old baud rate"));
  bench.tampered.requests({});
  EXPECT_EQ(bench.run("position").error, Error::none);
}
TEST(HiperfaceProcedures, ScanFindsEncoder) {
  Bench bench(unit, "address=0x5F");
  const RunResult found = bench.run("scan");
  EXPECT_EQ(found.error, Error::none);
  EXPECT_EQ(found.numbers.at("encoder_address"), 0x5F);
  Bench slow(unit, "baud=600");
  const RunResult slowly = slow.run("scan");
  EXPECT_EQ(slowly.error, Error::none) << slowly.detail;
  EXPECT_EQ(slowly.numbers.at("encoder_address"), 0x40);
}
TEST(HiperfaceProcedures, AddressIsReadFromEncoderOfAnyAddress) {
  Bench bench(unit, "address=0x4A");
  bench.tell("address=0x40 singleturn_bits=15");
  const RunResult read = bench.run("address");
  EXPECT_EQ(read.error, Error::none);
  EXPECT_EQ(read.numbers.at("new_address"), 0x4A);
}

}  // namespace
}  // namespace absenc::hiperface
