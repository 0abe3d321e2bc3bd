// SPDX-License-Identifier: Apache-2.0
// Memory conversations against the virtual QS35 in virtual time.
#include "absenc/protocol/esl/memory.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/esl/bench_test.hpp"

namespace absenc::esl {
namespace {

using testing::Bench;
using testing::report;
using Wire = std::vector<std::uint8_t>;

Wire wire(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

TEST(EslMemory, MemoryIsWrittenReadBackAndSparedWear) {
  Bench bench;
  WriteMemory write({}, 0, 0x7E, 0x5A);
  EXPECT_EQ(bench.run(write).error(), Error::none) << write.detail();
  EXPECT_TRUE(write.written());
  EXPECT_EQ(*bench.encoder.stored(0, 0x7E), 0x5A);
  EXPECT_EQ(bench.encoder.writes(), 1u);
  WriteMemory same({}, 0, 0x7E, 0x5A);
  EXPECT_EQ(bench.run(same).error(), Error::none);
  EXPECT_FALSE(same.written());
  WriteMemory insist({}, 0, 0x7E, 0x5A, Force::no, Wear::accept);
  EXPECT_EQ(bench.run(insist).error(), Error::none);
  EXPECT_EQ(bench.encoder.writes(), 2u);
  ReadMemory read({}, 0, 0x78, 7);
  EXPECT_EQ(bench.run(read).error(), Error::none) << read.detail();
  ASSERT_EQ(read.data().size(), 7u);
  EXPECT_EQ(read.data()[6], 0x5A);
  EXPECT_EQ(read.data()[5], 0x00);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(EslMemory, EveryAreaOfTable11IsReadAndWrittenWithForce) {
  for (const MemoryArea& area : memory_map) {
    Bench bench;
    for (const std::uint8_t address : {area.first, area.last}) {
      if (area.page == register_page && address == error_info_address) continue;
      WriteMemory closed({}, area.page, address, 0x42);
      EXPECT_EQ(bench.run(closed).error(), area.user ? Error::none : Error::invalid_argument);
      EXPECT_EQ(closed.detail().find("needs force") != std::string_view::npos, !area.user);
      WriteMemory forced({}, area.page, address, 0x43, Force::yes);
      EXPECT_EQ(bench.run(forced).error(), Error::none) << int{area.page} << " " << int{address} << forced.detail();
      ReadMemory read({}, area.page, address);
      EXPECT_EQ(bench.run(read).error(), Error::none);
      EXPECT_EQ(read.data()[0], 0x43);
    }
    EXPECT_EQ(bench.encoder.violation_count(), 0u) << bench.encoder.violations()[0].rule;
  }
}

TEST(EslMemory, WhatTable11LacksIsRefusedBeforeAnythingIsSent) {
  Bench bench;
  ReadMemory page_7({}, 7, 0);
  EXPECT_EQ(bench.run(page_7).error(), Error::invalid_argument);
  ReadMemory past_the_end({}, 0, 0x7E, 2);
  EXPECT_EQ(bench.run(past_the_end).error(), Error::invalid_argument);
  WriteMemory page_select({}, 0, page_select_address, 1, Force::yes);
  EXPECT_EQ(bench.run(page_select).error(), Error::invalid_argument);
  SelectPage page_9({}, 9);
  EXPECT_EQ(bench.run(page_9).error(), Error::invalid_argument);
  EXPECT_FALSE(page_9.detail().empty());
  EXPECT_EQ(bench.encoder.answered(), 0u);
}

TEST(EslMemory, ThePageThatADriveHadSelectedIsRestored) {
  for (const std::uint8_t before : std::to_array<std::uint8_t>({0, 8, 14})) {
    Bench bench;
    SelectPage select({}, before);
    ASSERT_EQ(bench.run(select).error(), Error::none);
    ReadErrorInfo info({});
    EXPECT_EQ(bench.run(info).error(), Error::none);
    EXPECT_EQ(testing::report(info).count("page_left"), 0u);
    EXPECT_EQ(bench.raw(Request{DataId::read_memory, 0, page_select_address})[2], before);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
  Bench mute({}, [](unsigned index, auto& reply) {
    if (index < 3) reply.clear();  // it does not say which page is selected
  });
  ReadErrorInfo info({});
  EXPECT_EQ(mute.run(info).error(), Error::none);
  EXPECT_EQ(testing::report(info)["page_left"], 8);
}

TEST(EslMemory, MemoryOnABusIsRefused) {
  Bench bench({.bus = true});
  WriteMemory write(bench.profile, 0, 0, 1);
  EXPECT_EQ(bench.run(write).error(), Error::unsupported);
  EXPECT_NE(write.detail().find("several encoders on the line"), std::string_view::npos);
  EXPECT_TRUE(bench.raw(Request{DataId::read_memory, 0, 1}).empty());
  ASSERT_EQ(bench.encoder.violation_count(), 1u);
}

TEST(EslMemory, AMemoryThatStaysBusyIsGivenUp) {
  Bench bench({}, [](unsigned index, Wire& reply) {
    if (index > 0) reply = wire(encode_reply({}, {.id = DataId::read_memory, .memory_address = 1, .busy = true}));
  });
  ReadMemory read({}, 0, 1);
  EXPECT_EQ(bench.run(read).error(), Error::busy);
  EXPECT_NE(read.detail().find("stays busy"), std::string_view::npos);
  EXPECT_LT(bench.line.now(), 100ms);
}

// The temporary register may hold what somebody else once asked for.
TEST(EslMemory, AnEepromByteIsNotBelievedWithoutABusyAnswerBefore) {
  Bench bench({}, [](unsigned index, Wire& reply) {
    if (index == 1) reply = wire(encode_reply({}, {.id = DataId::read_memory, .memory_address = 5, .value = 0x77}));
  });
  *bench.encoder.stored(0, 5) = 0x78;
  ReadMemory read({}, 0, 5);
  EXPECT_EQ(bench.run(read).error(), Error::none);
  EXPECT_EQ(read.data()[0], 0x78);
}

TEST(EslMemory, AWriteWhoseReplyIsLostIsJudgedByReadingBack) {
  Bench bench({}, [](unsigned index, Wire& reply) {
    if (index == 3) reply.pop_back();  // page select, two reads, write
  });
  WriteMemory write({}, 1, 10, 0x33);
  EXPECT_EQ(bench.run(write).error(), Error::none) << write.detail();
  EXPECT_EQ(bench.encoder.writes(), 1u);  // never repeated
}

TEST(EslMemory, AWriteThatDoesNotHoldIsFound) {
  Bench bench({}, [](unsigned index, Wire& reply) {
    if (index != 5) return;  // the second request of the read-back
    reply = wire(encode_reply({}, {.id = DataId::read_memory, .memory_address = 10, .value = 0x32}));
  });
  WriteMemory write({}, 1, 10, 0x33);
  EXPECT_EQ(bench.run(write).error(), Error::cross_check_failed);
}

TEST(EslMemory, LedAndLissajousAreToldApart) {
  for (const bool lissajous : {false, true}) {
    Bench bench;
    bench.encoder.set_lissajous(lissajous);
    bench.encoder.raise_alarms(alarms::led_or_lissajous_error);
    const std::uint8_t sf = bench.read().one.status;
    EXPECT_EQ(sf & (status::safety_error | status::non_safety_error),
              lissajous ? status::non_safety_error : status::safety_error);
    ReadErrorInfo info({});
    EXPECT_EQ(bench.run(info).error(), Error::none);
    EXPECT_EQ(report(info)["led_error"], lissajous ? 0 : 1);
    EXPECT_EQ(report(info)["lissajous_error"], lissajous ? 1 : 0);
  }
}

}  // namespace
}  // namespace absenc::esl
