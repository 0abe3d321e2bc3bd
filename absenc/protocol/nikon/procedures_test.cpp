// SPDX-License-Identifier: Apache-2.0
// Tests of commands of several requests, with a virtual encoder of Nikon's A-format.
#include <gtest/gtest.h>

#include <vector>

#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/nikon/bench_test.hpp"

namespace absenc::nikon {
namespace {

using testing::Bench;
using testing::Numbers;
using testing::wire;
using testing::Wire;

// Returns a function that puts `reply` in place of each reply of the encoder whose number, counted from 0, is at least
// `from` and less than `to`.
testing::Tamper replace(unsigned from, unsigned to, Wire reply) {
  return [=](unsigned index, Wire& bytes) {
    if (index >= from && index < to) bytes = reply;
  };
}
Wire identity_reply(std::uint32_t identity, std::uint8_t address = 0) {
  return wire(encode_reply(Code::read_identity, {.address = address, .data = identity}).view());
}

// ---- Resets

TEST(NikonProcedures, ResetsAreVerified) {
  Bench bench;
  bench.shaft.put(5, 0x12345);
  bench.device.raise_alarms(alarm::over_temperature);
  const auto zeroed = bench.run("zero");
  EXPECT_EQ(zeroed.error, Error::none);
  EXPECT_EQ(zeroed.numbers, (Numbers{{"encoder_address", 0},
                                     {"encoder_status", 1},
                                     {"singleturn", 0},
                                     {"multiturn", 5},
                                     {"alarms", alarm::over_temperature}}));
  EXPECT_EQ(zeroed.frames, 2 + 2 + 8 + 2);
  EXPECT_EQ(bench.run("clear-turns").numbers.at("multiturn"), 0);
  EXPECT_EQ(bench.run("position").numbers.at("alarms"), alarm::over_temperature);
  EXPECT_EQ(bench.run("clear-alarms").numbers.at("alarms"), 0);
  bench.shaft.put(7, 0x12345);
  bench.device.raise_alarms(alarm::battery);
  const auto cleared = bench.run("reset-multiturn");
  EXPECT_EQ(cleared.numbers.at("multiturn"), 0);
  EXPECT_EQ(cleared.numbers.at("alarms"), 0);
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(NikonProcedures, ResetsNeedAStandingShaft) {
  for (const auto& [command, error] : {std::pair{"zero", Error::not_still},
                                       {"reset-multiturn", Error::not_still},
                                       {"clear-turns", Error::not_still},
                                       {"clear-alarms", Error::none}}) {
    Bench bench;
    bench.shaft.spin(60, Time{});
    EXPECT_EQ(bench.run(command).error, error) << command;
  }
  Bench bench;
  bench.device.raise_alarms(alarm::singleturn_error);
  EXPECT_EQ(bench.run("zero").error, Error::invalid_argument) << "the position does not hold";
  EXPECT_EQ(bench.run("reset-multiturn").error, Error::none);
}

TEST(NikonProcedures, ResetsThatFailSayWhy) {
  struct Row {
    std::string_view command;
    OneReply position;
    std::uint16_t alarms;
    std::string_view detail;
  };
  // A position of 0x3FB counts is just below the tolerance of 0.35 degrees, 0x400 is above it.
  for (const Row& row :
       {Row{"zero", {.data = 0x400}, 0, "the position is still not zero"},
        Row{"zero", {.data = 0x3FB}, alarm::battery, ""},
        Row{"reset-multiturn", {.data = 1 << 20}, 0, "the turns are still not zero"},
        Row{"reset-multiturn", {}, alarm::battery, "alarms remain"},
        Row{"clear-turns", {.data = 1 << 20}, 0, "the turns are still not zero"},
        Row{"clear-turns", {}, alarm::battery, ""}, Row{"clear-alarms", {.data = 1 << 20}, alarm::memory_busy, ""},
        Row{"clear-alarms", {}, alarm::battery, "alarms remain"}}) {
    Bench bench([&](unsigned index, Wire& reply) {
      if (index == 12) reply = wire(encode_reply(Code::position, row.position).view());
      if (index == 13) reply = wire(encode_reply(Code::alarms, {.data = row.alarms}).view());
    });
    const auto ended = bench.run(row.command);
    EXPECT_EQ(ended.error, row.detail.empty() ? Error::none : Error::cross_check_failed) << row.command;
    EXPECT_EQ(ended.detail, row.detail) << row.command;
  }
}

// The command ends only when the encoder has stored the reset; if a reply is lost, the host sends no further request.
TEST(NikonProcedures, ResetEndsWithItsRow) {
  Bench bench;
  const auto good = bench.run("clear-alarms");
  EXPECT_GE(good.took, author::between_looks + memory_write_time);
  Bench lost(replace(6, 7, {}));
  const auto ended = lost.run("clear-alarms");
  EXPECT_EQ(ended.error, Error::timeout);
  EXPECT_TRUE(ended.says("one of the requests in a row was not answered well")) << ended.detail;
  EXPECT_EQ(ended.frames, 7u);
}

// ---- EEPROM

TEST(NikonProcedures, ReadsWordsOneAfterTheOther) {
  Bench bench;
  for (const auto& [address, value] : {std::pair{0xEE, 0x1234}, {0xEF, 0xABCD}}) {
    EXPECT_EQ(bench.run("memory-write", {address, value}).numbers,
              (Numbers{{"address", address}, {"value", value}, {"written", 1}}));
  }
  EXPECT_EQ(bench.run("memory-read", {0xEF}).numbers, (Numbers{{"address", 0xEF}, {"value", 0xABCD}}));
  const auto words = bench.run("memory-read", {0xEE, 3});
  EXPECT_EQ(words.texts.at("data"), std::string("\x34\x12\xCD\xAB\0\0", 6));
  EXPECT_EQ(words.numbers.at("address"), 0xEE);
  EXPECT_EQ(bench.run("memory-read", {0, 256}).texts.at("data").size(), 512u);
  EXPECT_EQ(bench.run("memory-read", {0xF9}).numbers.at("value"), 140);
  EXPECT_EQ(bench.run("memory-read", {255, 2}).error, Error::invalid_argument);
  EXPECT_EQ(bench.run("memory-read", {255, 1}).error, Error::none);
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(NikonProcedures, RefusesAnotherWord) {
  Bench bench(replace(1, 2, wire(encode_reply(Code::read_memory, {.data = 0x05'0000}).view())));
  const auto ended = bench.run("memory-read", {4});
  EXPECT_EQ(ended.error, Error::unexpected_reply);
  EXPECT_EQ(ended.detail, "the encoder sends another word than it was asked for");
}

TEST(NikonProcedures, WritesAWordOnlyIfItDiffersAndReadsItBack) {
  Bench bench;
  EXPECT_EQ(bench.run("memory-write", {1, 0x5A3C}).frames, 2u + 1 + 2);
  const auto same = bench.run("memory-write", {1, 0x5A3C});
  EXPECT_EQ(same.numbers.at("written"), 0);
  EXPECT_EQ(same.frames, 2u);
  const auto maker = bench.run("memory-write", {0xF0, 1});
  EXPECT_EQ(maker.error, Error::invalid_argument);
  EXPECT_EQ(maker.frames, 0u);
  EXPECT_EQ(bench.run("memory-write", {0xEF, 1}).error, Error::none);
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(NikonProcedures, ReadingBackDecidesWhetherAWordWasWritten) {
  struct Row {
    Wire reply;
    Error error;
    ChangeSent change;
  };
  const auto word = [](std::uint16_t value) {
    return wire(encode_reply(Code::read_memory, {.data = 1u << 16 | value}).view());
  };
  for (const Row& row :
       {Row{word(7), Error::none, ChangeSent::yes}, Row{word(0), Error::cross_check_failed, ChangeSent::refused},
        Row{word(8), Error::cross_check_failed, ChangeSent::yes}}) {
    Bench bench([&](unsigned index, Wire& reply) {
      if (index == 2) reply.clear();
      if (index == 4) reply = row.reply;
    });
    const author::testing::Talk<std::uint8_t> talk(unit, bench.options, "memory-write", {1, 7});
    const auto ended = bench.run(*talk);
    EXPECT_EQ(ended.error, row.error);
    EXPECT_EQ(talk->change_sent(), row.change);
  }
  Bench nothing(replace(0, 9, {}));
  EXPECT_TRUE(nothing.run("memory-write", {1, 7}).says("nothing was written"));
  Bench later(replace(2, 99, {}));
  EXPECT_TRUE(later.run("memory-write", {1, 7}).says("could not be read back"));
}

// ---- Identification and address

TEST(NikonProcedures, WritesTheIdentificationOnlyIfItDiffersAndReadsItBack) {
  for (const std::string_view order : {"low", "high"}) {
    Bench bench("bit_order=" + std::string(order));
    const auto read = bench.run("identification");
    EXPECT_EQ(read.numbers.at("identification"), 0xABCDEF);
    EXPECT_EQ(bench.run("set-identification", {0x123456}).numbers,
              (Numbers{{"identification", 0x123456}, {"written", 1}}));
    const auto same = bench.run("set-identification", {0x123456});
    EXPECT_EQ(same.numbers.at("written"), 0);
    EXPECT_EQ(same.frames, 1u);
    EXPECT_EQ(bench.violations(), 0u);
  }
  struct Row {
    std::uint32_t read;
    Error error;
    ChangeSent change;
  };
  for (const Row& row :
       {Row{7, Error::none, ChangeSent::yes}, Row{0xABCDEF, Error::cross_check_failed, ChangeSent::refused},
        Row{8, Error::cross_check_failed, ChangeSent::yes}}) {
    Bench bench([&](unsigned index, Wire& reply) {
      if (index == 1) reply.clear();
      if (index == 2) reply = identity_reply(row.read);
    });
    const author::testing::Talk<std::uint8_t> talk(unit, bench.options, "set-identification", {7});
    EXPECT_EQ(bench.run(*talk).error, row.error);
    EXPECT_EQ(talk->change_sent(), row.change);
  }
  Bench later(replace(1, 99, {}));
  EXPECT_TRUE(later.run("set-identification", {7}).says("could not be read back"));
}

// The encoder needs 30 ms to store what it was sent; only then does a reply show what it has stored.
TEST(NikonProcedures, ReadsBackWhenTheEncoderHasStored) {
  Bench bench;
  for (const auto& [command, arguments] :
       {std::pair<std::string_view, std::vector<std::int64_t>>{"memory-write", {1, 7}},
        {"set-identification", {7}},
        {"address", {5}},
        {"assign-address", {6, 7}}}) {
    const auto ended = bench.run(command, arguments);
    EXPECT_EQ(ended.numbers.at("written"), 1) << command;
    EXPECT_GE(ended.took, 30ms) << command;
  }
}

TEST(NikonProcedures, OnlyEncoderOfALineGetsAnotherAddress) {
  Bench bench("address=2");
  const auto moved = bench.run("address", {5});
  EXPECT_EQ(moved.numbers, (Numbers{{"encoder_address", 5}, {"identification", 0xABCDEF}, {"written", 1}}));
  EXPECT_EQ(moved.frames, 1u + 8 + 1);
  EXPECT_EQ(bench.run("position").error, Error::timeout);
  EXPECT_EQ(bench.run("only-encoder").numbers.at("encoder_address"), 5);
  bench.tell("address=5");
  EXPECT_EQ(bench.run("position").error, Error::none);
  const auto same = bench.run("address", {5});
  EXPECT_EQ(same.numbers.at("written"), 0);
  EXPECT_EQ(same.frames, 1u);
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(NikonProcedures, AddressIsNotSetBesideAnotherEncoder) {
  Bench bench;
  sim::testing::TestShaft<20> shaft;
  VirtualEncoder other({.address = 7}, shaft);
  other.power_on(Time{}, Bench::PowerOn::skip);
  bench.line.attach(sim::NodeRole::device, other);
  const auto refused = bench.run("address", {5});
  EXPECT_EQ(refused.error, Error::invalid_argument);
  EXPECT_TRUE(refused.says("another encoder answers on this line")) << refused.detail;
  EXPECT_EQ(bench.run("position").error, Error::none);
}

TEST(NikonProcedures, AddressIsVerifiedByTheIdentification) {
  Bench other(replace(9, 10, identity_reply(7, 5)));
  EXPECT_EQ(other.run("address", {5}).error, Error::cross_check_failed);
  Bench lost(replace(9, 99, {}));
  EXPECT_TRUE(lost.run("address", {5}).says("no encoder is found at the new address"));
}

TEST(NikonProcedures, EncoderWithAnIdentificationGetsAnAddress) {
  Bench bench;
  const auto moved = bench.run("assign-address", {5, 0xABCDEF});
  EXPECT_EQ(moved.numbers, (Numbers{{"encoder_address", 5}, {"identification", 0xABCDEF}, {"written", 1}}));
  const auto same = bench.run("assign-address", {5, 0xABCDEF});
  EXPECT_EQ(same.numbers.at("written"), 0);
  EXPECT_EQ(same.frames, 1u);
  EXPECT_EQ(bench.run("assign-address", {5, 7}).error, Error::invalid_argument) << "it has the address";
  const auto unknown = bench.run("assign-address", {6, 7});
  EXPECT_EQ(unknown.error, Error::timeout);
  EXPECT_TRUE(unknown.says("no encoder is found at the new address")) << unknown.detail;
  EXPECT_EQ(bench.violations(), 0u);
  Bench lost(replace(0, 1, {}));
  EXPECT_EQ(lost.run("assign-address", {5, 0xABCDEF}).error, Error::none) << "its answer at the address shows it";
}

TEST(NikonProcedures, ScanFindsTheEncodersOfALine) {
  Bench bench;
  sim::testing::TestShaft<20> shaft;
  VirtualEncoder other({.address = 7}, shaft);
  other.power_on(Time{}, Bench::PowerOn::skip);
  bench.line.attach(sim::NodeRole::device, other);
  const auto found = bench.run("scan");
  EXPECT_EQ(found.error, Error::none);
  EXPECT_EQ(found.numbers, (Numbers{{"encoder_address", 7}, {"clash", 0}})) << "the last of two";
  EXPECT_EQ(found.frames, 2u);
}

}  // namespace
}  // namespace absenc::nikon
