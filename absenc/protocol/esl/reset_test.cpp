// SPDX-License-Identifier: Apache-2.0
// Tests of the resets of alarms, turns and zero, with the virtual QS35 in virtual time.
#include <gtest/gtest.h>

#include <tuple>

#include "absenc/protocol/esl/bench_test.hpp"
#include "absenc/protocol/esl/host.hpp"

namespace absenc::esl {
namespace {

using testing::Bench;
using testing::RunResult;
using testing::Wire;
using testing::wire;

TEST(EslReset, Resets) {
  Bench bench;
  bench.shaft.put(12, 4'000'000);
  bench.encoder.raise_alarms(alarms::xc_error);
  RunResult after = bench.run("clear-alarms");
  EXPECT_EQ(after.error, Error::none) << after.detail;
  EXPECT_EQ(after.reading->alarms, 0u);
  EXPECT_EQ(after.reading->multiturn, 12u);
  after = bench.run("zero");
  EXPECT_EQ(after.error, Error::none) << after.detail;
  EXPECT_EQ(after.reading->singleturn, 0u);
  EXPECT_EQ(after.reading->multiturn, 12u);
  after = bench.run("reset-multiturn");
  EXPECT_EQ(after.error, Error::none) << after.detail;
  EXPECT_EQ(after.reading->multiturn, 0u);
  EXPECT_EQ(after.reading->singleturn, 0u);
  EXPECT_EQ(bench.violations(), 0u);
  // The zeros of both channels must survive power off.
  bench.restart();
  EXPECT_EQ(bench.read().singleturn, 0u);
  EXPECT_EQ(bench.read().redundant, 0u);
  EXPECT_EQ(bench.read().multiturn, 0u);
}

TEST(EslReset, ResetKeepsItsTimes) {
  for (const auto& [command, id, last] :
       {std::tuple{"zero", DataId::zero, Time(7ms)}, std::tuple{"reset-multiturn", DataId::reset_multiturn, Time(7ms)},
        std::tuple{"clear-alarms", DataId::clear_alarms, Time(40us)}}) {
    Bench bench;
    std::vector<Time> looks;
    std::vector<Time> starts;
    bench.line.observe([&, field = control_field({}, 0, id)](auto sender, Time start, Time, std::uint8_t byte) {
      if (sender != 1) return;
      if (byte == field) starts.push_back(start);
      if (byte == control_field({}, 0, DataId::position)) looks.push_back(start);
    });
    EXPECT_EQ(bench.run(command).error, Error::none);
    ASSERT_EQ(starts.size(), 8u);
    // The host waits 40 us from the end of each request, which lasts 2 us, to the next.
    for (std::size_t i = 1; i < 8; ++i) EXPECT_EQ(starts[i] - starts[i - 1], 42us);
    ASSERT_EQ(looks.size(), 3u);
    const Time reply = 18us + answer_time + 2us;
    EXPECT_EQ(looks[1] - looks[0], reply + 10ms);
    EXPECT_EQ(looks[2] - starts[7], 2us + answer_time + reply_length(id) * 1us + last);
  }
}

TEST(EslReset, NamesAlarmsThatRemain) {
  for (const auto& [raised, sentence] :
       {std::pair{alarms::overspeed + 0, "overspeed remains; switch the encoder off and on"},
        std::pair{alarms::multiturn_error + 0, "multiturn_error remains; multiturn_error: reset-multiturn first"},
        std::pair{alarms::under_voltage + 0, "under_voltage remains; the supply voltage is wrong"},
        std::pair{alarms::led_or_lissajous_error | alarms::over_voltage,
                  "led_or_lissajous_error, over_voltage remain; switch the encoder off and on; the supply voltage is "
                  "wrong"},
        std::pair{alarms::memory_error | alarms::singleturn_error | alarms::xc_error,
                  "memory_error, singleturn_error remain; switch the encoder off and on"}}) {
    Bench bench;
    bench.encoder.raise_alarms(static_cast<std::uint32_t>(raised));
    const RunResult clear = bench.run("clear-alarms");
    EXPECT_EQ(clear.error, Error::cross_check_failed);
    EXPECT_EQ(clear.detail, sentence);
  }
  Bench bench;
  bench.condition(condition::ch2_alarms, alarms::memory_error);
  EXPECT_EQ(bench.run("clear-alarms").detail, "memory_error remains; switch the encoder off and on");
}

TEST(EslReset, MultiturnErrorNeedsDThenC) {
  Bench bench;
  bench.shaft.put(7, 100);
  bench.encoder.raise_alarms(alarms::multiturn_error);
  const RunResult turns = bench.run("reset-multiturn");
  EXPECT_EQ(turns.error, Error::none);
  EXPECT_EQ(turns.numbers.at("ch1_alarms"), alarms::multiturn_error);
  const RunResult clear = bench.run("clear-alarms");
  EXPECT_EQ(clear.error, Error::none);
  EXPECT_EQ(clear.numbers.at("ch1_alarms"), 0);
}

TEST(EslReset, DetectsIdDThatMovesTheZero) {
  Bench bench;
  bench.shaft.put(7, 1'000'000);
  bench.condition(condition::id_d_clears_singleturn, 1);
  const RunResult turns = bench.run("reset-multiturn");
  EXPECT_EQ(turns.error, Error::cross_check_failed);
  EXPECT_TRUE(turns.says("single-turn zero too"));
}

TEST(EslReset, SendsNoResetToTurningOrStartingEncoder) {
  for (const std::int32_t rpm : {5, -5}) {
    Bench bench;
    bench.shaft.spin(rpm, Time{});
    const RunResult zero = bench.run("zero");
    EXPECT_EQ(zero.error, Error::not_still);
    EXPECT_TRUE(zero.says("nothing was changed"));
    EXPECT_EQ(bench.encoder.answer_count(), 2u);  // the host only read two positions and sent no reset
  }
  Bench starting;
  starting.restart(testing::PowerOn::real);
  const RunResult zero = starting.run("zero");
  EXPECT_EQ(zero.error, Error::invalid_argument);
  EXPECT_TRUE(zero.says("not ready"));
}

// The zero survives power off, so the host must not set it at an invalid position.
TEST(EslReset, SendsNoZeroAtInvalidPosition) {
  Bench bench;
  bench.shaft.put(7, 1'000'000);
  bench.encoder.raise_alarms(alarms::singleturn_error);
  const RunResult zero = bench.run("zero");
  EXPECT_EQ(zero.error, Error::invalid_argument);
  EXPECT_TRUE(zero.says("does not hold")) << zero.detail;
  EXPECT_EQ(bench.encoder.answer_count(), 2u);
  EXPECT_EQ(bench.encoder.memory_version(), 0u);
}

// If no exchange is repeated, replies 2 to 9 answer the reset and reply 10 verifies it.
TEST(EslReset, LostReplyStopsAResetUnlessItIsTheLast) {
  struct Row {
    unsigned first;
    unsigned last;
    Error error;
    const char* words;
    std::uint64_t sent;
    unsigned turns;
  };
  for (const Row& row :
       {Row{5, 5, Error::wrong_length, "most likely done nothing", 6, 5}, Row{9, 9, Error::none, "", 11, 0},
        Row{0, 2, Error::wrong_length, "", 3, 5}, Row{10, 12, Error::wrong_length, "whether the encoder obeyed", 13, 0},
        Row{0, 1, Error::none, "", 13, 0}}) {
    Bench bench({}, [&row](unsigned index, Wire& reply) {
      if (index >= row.first && index <= row.last) reply.pop_back();
    });
    bench.shaft.put(5, 0);
    const RunResult reset = bench.run("reset-multiturn");
    EXPECT_EQ(reset.error, row.error) << row.first;
    EXPECT_TRUE(reset.says(row.words)) << reset.detail;
    EXPECT_EQ(bench.encoder.answer_count(), row.sent) << row.first;
    EXPECT_EQ(bench.encoder.reply_to(DataId::position, bench.line.now()).multiturn, row.turns) << row.first;
  }
}

TEST(EslReset, DetectsResetThatFailed) {
  for (const auto& [command, counts, turns, words] :
       {std::tuple{"zero", 933 + 1, 0, "not zero"}, std::tuple{"reset-multiturn", 0, 1, "turns are still not zero"}}) {
    Bench bench({}, [counts = counts, turns = turns](unsigned index, Wire& reply) {
      if (index != 10) return;
      reply = wire({.one = {.status = status::ready},
                    .two = {.status = status::ready | status::channel_2},
                    .singleturn = static_cast<std::uint32_t>(counts),
                    .multiturn = static_cast<std::uint16_t>(turns)});
    });
    const RunResult reset = bench.run(command);
    EXPECT_EQ(reset.error, Error::cross_check_failed);
    EXPECT_TRUE(reset.says(words)) << reset.detail;
    EXPECT_FALSE(reset.reading.has_value());
  }
}

}  // namespace
}  // namespace absenc::esl
