// SPDX-License-Identifier: Apache-2.0
// Tests of the memory commands with the virtual QS35 in virtual time.
#include <gtest/gtest.h>

#include "absenc/protocol/esl/bench_test.hpp"

namespace absenc::esl {
namespace {

using testing::Bench;
using testing::RunResult;
using testing::Wire;
using testing::wire;

// Arguments of memory-read: address, page, count; of memory-write: address, value, page, force.
constexpr const char* read = "memory-read";
constexpr const char* write = "memory-write";

TEST(EslMemory, WritesMemoryOnlyIfItDiffersAndReadsItBack) {
  Bench bench;
  const RunResult first = bench.run(write, {0x7E, 0x5A, 0});
  EXPECT_EQ(first.error, Error::none) << first.detail;
  EXPECT_EQ(first.numbers.at("written"), 1);
  // the command gets these replies: page select, two reads, the write, and two reads after it
  EXPECT_EQ(bench.encoder.answer_count(), 6u);
  EXPECT_EQ(*bench.encoder.stored(0, 0x7E), 0x5A);
  const RunResult same = bench.run(write, {0x7E, 0x5A, 0});
  EXPECT_EQ(same.error, Error::none);
  EXPECT_EQ(same.numbers.at("written"), 0);
  EXPECT_EQ(bench.encoder.memory_version(), 1u);
  const RunResult bytes = bench.run(read, {0x78, 0, 7});
  EXPECT_EQ(bytes.error, Error::none) << bytes.detail;
  EXPECT_EQ(bytes.texts.at("data"), std::string("\0\0\0\0\0\0\x5A", 7));
  EXPECT_EQ(bytes.numbers.at("memory_address"), 0x78);
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(EslMemory, ProtectedMemoryNeedsForce) {
  for (const MemoryArea& area : memory_map) {
    Bench bench;
    const RunResult closed = bench.run(write, {area.first, 0x42, area.page});
    EXPECT_EQ(closed.error, area.page <= 3 ? Error::none : Error::invalid_argument);
    EXPECT_EQ(closed.says("needs force") && closed.says(std::string(area.meaning)), area.page > 3) << closed.detail;
    EXPECT_EQ(bench.encoder.answer_count() > 0, area.page <= 3);
    EXPECT_EQ(bench.run(write, {area.first, 0x43, area.page, 1}).error, Error::none) << area.page;
    EXPECT_EQ(bench.violations(), 0u);
  }
}

TEST(EslMemory, RefusesUnlistedMemoryBeforeSending) {
  Bench bench;
  for (const auto& [command, arguments] :
       {std::pair{read, std::vector<std::int64_t>{0, 7}}, std::pair{read, std::vector<std::int64_t>{0x7E, 0, 2}},
        std::pair{write, std::vector<std::int64_t>{page_select_address, 1, 0, 1}},
        std::pair{write, std::vector<std::int64_t>{0, 1, 7, 1}},
        std::pair{"select-page", std::vector<std::int64_t>{9}}}) {
    const RunResult refused = bench.run(command, arguments);
    EXPECT_EQ(refused.error, Error::invalid_argument);
    EXPECT_TRUE(refused.says("nothing was sent"));
  }
  EXPECT_EQ(bench.encoder.answer_count(), 0u);
}

TEST(EslMemory, RestoresThePageBefore) {
  for (const std::uint8_t before : std::to_array<std::uint8_t>({0, 8, 14})) {
    Bench bench;
    ASSERT_EQ(bench.run("select-page", {before}).error, Error::none);
    const RunResult info = bench.run("led-or-lissajous");
    EXPECT_EQ(info.error, Error::none);
    EXPECT_FALSE(info.numbers.contains("page_left"));
    EXPECT_EQ(bench.raw(Request{DataId::read_memory, 0, page_select_address})[2], before);
    EXPECT_EQ(bench.violations(), 0u);
  }
  // The encoder does not report the selected page, either at the begin of the command or at its end.
  for (const auto& [first, last] : {std::pair{1u, 3u}, std::pair{5u, 5u}}) {
    Bench bench({}, [first = first, last = last](unsigned index, Wire& reply) {
      if (index < first || index > last) return;
      reply = first == 1 ? Wire{} : wire({.id = DataId::read_memory, .memory_address = 0x7F, .value = 3});
    });
    bench.raw(Request{DataId::write_memory, 0, page_select_address, 0});
    bench.pass(page_time);
    const RunResult info = bench.run("led-or-lissajous");
    EXPECT_EQ(info.error, Error::none);
    ASSERT_TRUE(info.numbers.contains("page_left")) << first;
    EXPECT_EQ(info.numbers.at("page_left"), 8);
  }
}

TEST(EslMemory, DetectsPageThatIsNotSelected) {
  Bench bench({}, [](unsigned index, Wire& reply) {
    if (index == 1) reply = wire({.id = DataId::read_memory, .memory_address = page_select_address, .value = 3});
  });
  const RunResult select = bench.run("select-page", {4});
  EXPECT_EQ(select.error, Error::cross_check_failed);
  EXPECT_EQ(select.detail, "another page is selected");
}

TEST(EslMemory, RefusesMemoryOnABus) {
  Bench bench({.bus = sharing_yes});
  for (const auto& [command, arguments] :
       {std::pair{read, std::vector<std::int64_t>{0}}, std::pair{write, std::vector<std::int64_t>{0, 1, 0}},
        std::pair{"select-page", std::vector<std::int64_t>{0}}}) {
    const RunResult refused = bench.run(command, arguments);
    EXPECT_EQ(refused.error, Error::unsupported);
    EXPECT_TRUE(refused.says("several encoders on the line")) << refused.detail;
  }
  EXPECT_TRUE(bench.raw(Request{DataId::read_memory, 0, 1}).empty());
  ASSERT_EQ(bench.violations(), 1u);
}

TEST(EslMemory, EndsIfMemoryStaysBusy) {
  Bench bench({}, [](unsigned index, Wire& reply) {
    if (index > 0) reply = wire({.id = DataId::read_memory, .memory_address = 1, .busy = true});
  });
  const RunResult bytes = bench.run(read, {1, 0});
  EXPECT_EQ(bytes.error, Error::busy);
  EXPECT_TRUE(bytes.says("stays busy"));
  EXPECT_GT(bench.line.now(), page_time + 2 * page_time);
  EXPECT_LT(bench.line.now(), 100ms);
}

// The encoder's temporary register may hold a byte that another host requested.
TEST(EslMemory, IgnoresEepromByteWithoutABusyReplyBefore) {
  Bench bench({}, [](unsigned index, Wire& reply) {
    if (index == 1) reply = wire({.id = DataId::read_memory, .memory_address = 5, .value = 0x77});
  });
  *bench.encoder.stored(0, 5) = 0x78;
  const RunResult bytes = bench.run(read, {5, 0});
  EXPECT_EQ(bytes.error, Error::none);
  EXPECT_EQ(bytes.numbers.at("value"), 0x78);
}

// The command memory-write gets these replies: page select, two reads, write, two reads.
TEST(EslMemory, WriteErrors) {
  struct Row {
    unsigned index;
    Error error;
    const char* words;
    std::uint32_t writes;
    testing::Tamper tamper;
  };
  const auto cut = [](unsigned, Wire& reply) { reply.pop_back(); };
  const auto other = [](unsigned, Wire& reply) {
    reply = wire({.id = DataId::read_memory, .memory_address = 10, .value = 0x32});
  };
  for (const Row& row : {Row{0, Error::none, "", 1, cut}, Row{2, Error::none, "", 1, cut},
                         // If the reply to the write is cut, the host does not repeat the write; it reads the byte
                         // back.
                         Row{3, Error::none, "", 1, cut},
                         Row{5, Error::cross_check_failed, "reading back gave another value", 1, other}}) {
    Bench bench({}, [&row](unsigned index, Wire& reply) {
      if (index == row.index) row.tamper(index, reply);
    });
    const RunResult outcome = bench.run(write, {10, 0x33, 1});
    EXPECT_EQ(outcome.error, row.error) << row.index << outcome.detail;
    EXPECT_TRUE(outcome.says(row.words)) << outcome.detail;
    EXPECT_EQ(bench.encoder.memory_version(), row.writes) << row.index;
    EXPECT_EQ(bench.violations(), 0u) << row.index;
  }
  for (const auto& [from, words] : {std::pair{0u, "nothing was written"}, std::pair{1u, "nothing was written"},
                                    std::pair{4u, "could not be read back"}}) {
    Bench bench({}, [from = from](unsigned index, Wire& reply) {
      if (index >= from) reply[2] ^= 1;
    });
    const RunResult outcome = bench.run(write, {10, 0x33, 1});
    EXPECT_EQ(outcome.error, Error::bad_checksum) << from;
    EXPECT_TRUE(outcome.says(words)) << outcome.detail;
    EXPECT_GE(bench.line.now(), outcome.received_at + (from == 0 ? page_time : eeprom_read_time));
  }
}

TEST(EslMemory, DistinguishesLedAndLissajous) {
  for (const bool lissajous : {false, true}) {
    Bench bench;
    bench.condition(condition::lissajous, lissajous ? 1 : 0);
    bench.encoder.raise_alarms(alarms::led_or_lissajous_error);
    const std::uint8_t sf = bench.read().one.status;
    EXPECT_EQ(sf & (status::safety_error | status::non_safety_error),
              lissajous ? status::non_safety_error : status::safety_error);
    const RunResult info = bench.run("led-or-lissajous");
    EXPECT_EQ(info.error, Error::none);
    EXPECT_EQ(info.numbers.at("led_error"), lissajous ? 0 : 1);
    EXPECT_EQ(info.numbers.at("lissajous_error"), lissajous ? 1 : 0);
  }
}

// The status field (SF) is ambiguous if it has both error bits and an alarm other than led_or_lissajous_error causes
// one of them.
TEST(EslMemory, DistinguishesLedAndLissajousOnABusByStatus) {
  constexpr int open = -1;
  struct Row {
    unsigned alarms;
    bool lissajous;
    int led_error;
    int lissajous_error;
  };
  using alarms::led_or_lissajous_error;
  for (const Row& row :
       {Row{led_or_lissajous_error, false, 1, 0}, Row{led_or_lissajous_error, true, 0, 1}, Row{0, false, 0, 0},
        Row{alarms::memory_error, false, 0, 0}, Row{led_or_lissajous_error | alarms::memory_error, false, 1, 0},
        Row{led_or_lissajous_error | alarms::memory_error, true, open, 1},
        Row{led_or_lissajous_error | alarms::overspeed, false, 1, open},
        Row{led_or_lissajous_error | alarms::xc_error, true, 0, 1}}) {
    Bench bench({.bus = sharing_yes});
    bench.condition(condition::lissajous, row.lissajous ? 1 : 0);
    bench.encoder.raise_alarms(row.alarms);
    const RunResult info = bench.run("led-or-lissajous");
    ASSERT_EQ(info.error, Error::none) << row.alarms;
    const auto told = [&info](const char* name) {
      return info.numbers.count(name) != 0 ? static_cast<int>(info.numbers.at(name)) : open;
    };
    EXPECT_EQ(told("led_error"), row.led_error) << row.alarms;
    EXPECT_EQ(told("lissajous_error"), row.lissajous_error) << row.alarms;
    EXPECT_EQ(bench.violations(), 0u);
  }
  Bench bench({.bus = sharing_yes});
  bench.encoder.raise_alarms(led_or_lissajous_error | alarms::memory_error | alarms::overspeed);
  const RunResult info = bench.run("led-or-lissajous");
  EXPECT_EQ(info.error, Error::unsupported);
  EXPECT_TRUE(info.says("other alarms")) << info.detail;
}

}  // namespace
}  // namespace absenc::esl
