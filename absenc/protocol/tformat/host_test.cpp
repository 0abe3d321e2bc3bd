// SPDX-License-Identifier: Apache-2.0
// Tests of conversations that read the position, and of refused requests.
#include "absenc/protocol/tformat/host.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/author/known_test.hpp"
#include "absenc/protocol/tformat/bench_test.hpp"

namespace absenc::tformat {
namespace {

using testing::Bench;
using testing::Numbers;
using testing::PowerOn;
using testing::refuse;
using testing::Tamper;
using testing::Wire;

// ---- Positions

TEST(TformatHost, ReadsEverythingInTheTimeOfTheWire) {
  Bench bench;
  bench.shaft.put(4660, 0x12345);
  ReadPosition read({});
  bench.run(read);
  ASSERT_EQ(read.error(), Error::none);
  EXPECT_EQ(bench.line.now(), 4us + 3us + 11 * 4us);
  ASSERT_NE(read.reading(), nullptr);
  EXPECT_EQ(read.reading()->singleturn, 0x12345u);
  EXPECT_EQ(read.reading()->multiturn, 4660u);
  EXPECT_TRUE(read.reading()->singleturn_valid());
  EXPECT_TRUE(read.reading()->multiturn_valid);
  EXPECT_EQ(read.reading()->latched, 4us);
  EXPECT_EQ(read.reading()->received, 51us);
  EXPECT_EQ(bench.run("position").numbers, (Numbers{{"data_id", 3},
                                                    {"status", 0},
                                                    {"singleturn", 0x12345},
                                                    {"encoder_id", 17},
                                                    {"multiturn", 4660},
                                                    {"alarms", 0}}));
}

constexpr Format known_17{.encoder_id = 17};
constexpr Format known_23{.singleturn_bits = 23, .encoder_id = 0x17};
constexpr Format known_loose{.strict = false};
constexpr Request known_singleturn{DataId::singleturn};

TEST(TformatHost, ReadsKnownFormatLikeAnyFormat) {
  const auto frame = [](const Reply& reply) { return author::testing::wire(encode_reply(reply)); };
  const Wire good = frame({.singleturn = 0x12345, .multiturn = 4660, .encoder_id = 17});
  author::testing::expect_known_as_any<Protocol, known_17, everything>(good);
  author::testing::expect_known_as_any<Protocol, known_loose, everything>(good);
  author::testing::expect_known_as_any<Protocol, known_23, everything>(
      frame({.status = status::alarm, .singleturn = 0x712345, .encoder_id = 0x17, .alarms = alarms::over_heat}));
  author::testing::expect_known_as_any<Protocol, known_17, known_singleturn>(
      frame({.id = DataId::singleturn, .singleturn = 0x12345}));
}

TEST(TformatHost, ReadsPartsWithTheirAlarms) {
  Bench bench;
  bench.shaft.put(4660, 0x12345);
  ReadPosition first({}, DataId::singleturn);
  EXPECT_EQ(bench.run(first).reading()->singleturn, 0x12345u);
  EXPECT_TRUE(first.reading()->singleturn_valid());
  EXPECT_EQ(bench.encoder.answer_count(), 2u);  // the host sent two requests: one with data ID 3, then one with ID 0
  ReadPosition turns({}, DataId::multiturn, 0);
  EXPECT_EQ(bench.run(turns).reading()->multiturn, 4660u);
  EXPECT_EQ(bench.encoder.answer_count(), 3u);
  bench.encoder.raise_alarms(alarms::multiturn_error);
  ReadPosition alarmed({}, DataId::multiturn, 0);
  bench.run(alarmed);
  EXPECT_EQ(bench.encoder.answer_count(), 5u);  // the host sent two requests: one with data ID 1, then one with ID 3
  EXPECT_FALSE(alarmed.reading()->multiturn_valid);
  EXPECT_EQ(alarmed.reading()->alarms, alarms::multiturn_error);
  const auto id = bench.run("encoder-id");
  EXPECT_FALSE(id.reading);
  EXPECT_EQ(id.numbers.at("encoder_id"), 0x11);
}

TEST(TformatHost, TurnsStayValidWithOtherAlarms) {
  Bench bench;
  bench.shaft.put(12, 0);
  bench.encoder.raise_alarms(alarms::over_heat | alarms::battery_alarm);
  ReadPosition turns({}, DataId::multiturn);
  EXPECT_EQ(bench.run(turns).reading()->multiturn_validity(), Validity::valid);
  EXPECT_EQ(turns.reading()->alarms, alarms::over_heat | alarms::battery_alarm);
  EXPECT_EQ(bench.encoder.answer_count(), 2u);
  bench.encoder.raise_alarms(alarms::multiturn_error);
  ReadPosition lost({}, DataId::multiturn);
  EXPECT_EQ(bench.run(lost).reading()->multiturn_validity(), Validity::invalid);
}

TEST(TformatHost, TimeoutIsNotRepeated) {
  Bench bench;
  bench.encoder.power_off(Time{});
  ReadPosition read({});
  EXPECT_EQ(bench.run(read).error(), Error::timeout);
  EXPECT_EQ(bench.line.now(), 4us + answer_limit);
}

// ---- Refusals (6.3.2)

TEST(TformatHost, ExplainsRefusals) {
  struct Row {
    std::uint8_t alarm;
    std::string_view command;
    std::string_view detail;
    bool again;
  };
  for (const Row& row : {Row{status::parity_error, "position", "ca0: it received", true},
                         Row{status::delimiter_error, "position", "ca1: it received a damaged character", true},
                         Row{status::rejected, "encoder-id", "ca0 and ca1", true},
                         Row{0, "encoder-id", "without a communication alarm", false}}) {
    Bench bench(refuse(0, 9, row.alarm));
    const auto read = bench.run(row.command);
    EXPECT_EQ(read.error, Error::request_rejected);
    EXPECT_TRUE(read.says(row.detail)) << read.detail;
    EXPECT_EQ(read.advice.starts_with("send the same request again"), row.again);
    EXPECT_EQ(read.advice.empty(), !row.again);
    EXPECT_EQ(bench.encoder.answer_count(), 1u);
  }
  Bench middle(refuse(5, 6, status::parity_error));
  const auto reset = middle.run("clear-alarms");
  EXPECT_EQ(reset.error, Error::request_rejected);
  EXPECT_TRUE(reset.says("ca0: ")) << reset.detail;
  EXPECT_TRUE(reset.says("; one of the requests in a row")) << reset.detail;
}

// A capture may have a reply without its request, or a reply to an invalid request (8.4, 9.4).
TEST(TformatHost, GuessesRequestsAndRefusesInvalidOnes) {
  const Bench bench;
  const auto error = [&bench](const Wire& request, const Wire& reply) {
    NoFields nowhere;
    return unit.decode(bench.options, {.bytes = request}, {.bytes = reply}, nowhere);
  };
  const Wire good = testing::wire(Reply{.id = DataId::everything, .encoder_id = 0x11});
  EXPECT_EQ(error({}, good), Error::none);
  // This reply has a data ID that Table 1 does not list.
  EXPECT_EQ(error({}, {0x22, 0, 0, 0, 0, 0x22}), Error::unexpected_reply);
  EXPECT_EQ(error({0x9A}, good), Error::request_rejected);
  EXPECT_EQ(error({0x9A}, Wire(good.begin(), good.end() - 1)), Error::bad_checksum);
}

TEST(TformatHost, ProceduresRepeatRefusedRequests) {
  // a refusal replaces reply 2, to the memory read after the page select
  Bench bench(refuse(2, 3, status::parity_error));
  const auto read = bench.run("temperature");
  EXPECT_EQ(read.error, Error::none);
  EXPECT_EQ(read.numbers, (Numbers{{"temperature_c", 35}}));
}

}  // namespace
}  // namespace absenc::tformat
