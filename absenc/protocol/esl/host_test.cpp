// SPDX-License-Identifier: Apache-2.0
// Host conversations against the virtual QS35 in virtual time.
#include "absenc/protocol/esl/host.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/esl/bench_test.hpp"
#include "absenc/protocol/esl/settings.hpp"

namespace absenc::esl {
namespace {

using testing::Bench;
using testing::report;
using Wire = std::vector<std::uint8_t>;

Wire wire(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

TEST(EslHost, ReadsTheSafetyPositionInTheTimeOfTheWire) {
  Bench bench;
  bench.shaft.put(4660, 0xABCDEF);
  Read read({});
  bench.run(read);
  ASSERT_EQ(read.error(), Error::none);
  EXPECT_EQ(bench.line.now(), 2us + answer_time + 18us);
  ASSERT_NE(read.reading(), nullptr);
  EXPECT_EQ(read.reading()->singleturn, 0xABCDEFu);
  EXPECT_EQ(read.reading()->multiturn, 4660u);
  EXPECT_TRUE(read.reading()->singleturn_valid() && read.reading()->multiturn_valid && read.reading()->ready);
  EXPECT_EQ(read.reading()->latched, 1us + position_time);  // the end bit of CF is over after one character
  EXPECT_EQ(read.reading()->received, 22us);
  EXPECT_EQ(report(read)["redundant_singleturn"], 0xABCDEF >> 15);
}

TEST(EslHost, ReadsEveryId) {
  Bench bench;
  bench.shaft.put(4660, 0xABCDEF);
  bench.encoder.set_environment({.temperature = -10});
  EXPECT_EQ(bench.read(DataId::singleturn).singleturn, 0xABCDEFu);
  EXPECT_EQ(bench.read(DataId::position_short).multiturn, 4660u);
  EXPECT_EQ(bench.read(DataId::singleturn_short).singleturn, 0xABCDEFu);
  EXPECT_EQ(bench.read(DataId::calibration).redundant, 0xABCDu);
  EXPECT_EQ(bench.read(DataId::alarms).one.alarms, 0);
  Read temperature({}, DataId::temperature);
  bench.run(temperature);
  EXPECT_EQ(report(temperature)["temperature_c"], -10);
  EXPECT_EQ(temperature.reading(), nullptr);
  Read id({}, DataId::encoder_id);
  bench.run(id);
  EXPECT_EQ(report(id)["encoder_id"], 0xD8);
  EXPECT_EQ(report(id)["safety"], 1);
  EXPECT_EQ(report(id)["multiturn_bytes"], 2);
  EXPECT_EQ(report(id)["singleturn_bits"], 24);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(EslHost, Id8IsNeverSentEightTimesInARow) {
  Bench bench;
  for (unsigned i = 0; i < 20; ++i) EXPECT_EQ(bench.read(DataId::encoder_id).one.encoder_id, 0xD8);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
  for (unsigned i = 0; i < 8; ++i) bench.raw(Request{DataId::encoder_id});
  ASSERT_EQ(bench.encoder.violation_count(), 1u);  // the rule is watched
}

// Every profile on both sides; another address too.
TEST(EslHost, EveryProfileIsSpokenOnBothSides) {
  for (std::size_t option = 0; option < open_options; ++option) {
    for (std::size_t value = 0; value < options[option].choices.size(); ++value) {
      Profile profile{.address = 5};
      set_option(profile, option, static_cast<std::int64_t>(value));
      Bench bench(profile);
      bench.shaft.put(-1, 0xABCDEF);
      ReadSafePosition safe(profile);
      ASSERT_EQ(bench.run(safe).error(), Error::none) << options[option].name << "=" << options[option].choices[value];
      EXPECT_EQ(safe.position()->singleturn(), 0xABCDEFu);
      EXPECT_EQ(safe.position()->encoder_address(), 5);
      EXPECT_EQ(bench.read(DataId::position).multiturn, 0xFFFFu);
      EXPECT_EQ(bench.read(DataId::calibration).singleturn, 0xABCDEFu);
      ReadErrorInfo info(profile);
      EXPECT_EQ(bench.run(info).error(), Error::none);
      Reset zero(profile, DataId::zero);
      EXPECT_EQ(bench.run(zero).error(), Error::none) << zero.detail();
      EXPECT_EQ(bench.encoder.violation_count(), 0u);
    }
  }
}

TEST(EslHost, SilenceIsATimeout) {
  Bench bench;
  bench.encoder.power_off(Time{});
  Read read({});
  EXPECT_EQ(bench.run(read).error(), Error::timeout);
  EXPECT_EQ(bench.line.now(), 2us + answer_limit);
  EXPECT_NE(read.detail().find("request_crc"), std::string_view::npos);
  EXPECT_EQ(read.exchange().sent.size(), 2u);
}

// Each with its own name and sentence.
TEST(EslHost, WhatIsWrongWithAReplyIsSaid) {
  struct Row {
    const char* sentence;
    Error error;
    testing::Tampered::Tamper tamper;
  };
  const Profile other_address{.address = 1};
  const std::vector<Row> rows{
      {"CRC of channel 1 is wrong", Error::bad_checksum, [](unsigned, Wire& reply) { reply[4] ^= 1; }},
      {"CRC of channel 2 is wrong", Error::bad_checksum, [](unsigned, Wire& reply) { reply[13] ^= 1; }},
      {"channels are swapped", Error::bad_checksum,
       [](unsigned, Wire& reply) { std::rotate(reply.begin(), reply.begin() + 11, reply.end()); }},
      {"channel 2 is missing", Error::wrong_length, [](unsigned, Wire& reply) { reply.resize(11); }},
      {"number of bytes", Error::wrong_length, [](unsigned, Wire& reply) { reply.pop_back(); }},
      {"address of another encoder", Error::unexpected_reply,
       [&](unsigned, Wire& reply) {
         reply = wire(encode_reply(other_address, {.encoder_address = 1, .one = {.status = status::ready}}));
       }},
      {"wrong parity bit in the request", Error::request_rejected,
       [](unsigned, Wire& reply) { reply = wire(encode_reply({}, {.one = {.status = status::parity_error}})); }},
  };
  for (const Row& row : rows) {
    Bench bench({}, row.tamper);
    Read read({});
    EXPECT_EQ(text_of(bench.run(read).error()).name, text_of(row.error).name) << row.sentence;
    EXPECT_NE(read.detail().find(row.sentence), std::string_view::npos) << read.detail();
    EXPECT_EQ(read.reading(), nullptr);
    EXPECT_GE(bench.line.now(), read.exchange().received_at + gap_limit) << row.sentence;
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

TEST(EslHost, ARepeatedFrameMakesNoSafePosition) {
  Wire kept;
  Bench bench({}, [&kept](unsigned index, Wire& reply) {
    if (index == 2) kept = reply;
    if (index == 3) reply = kept;
  });
  bench.shaft.spin(60, Time{});
  SafetyMonitor monitor({});
  struct OneRead final : Procedure {
    OneRead(SafetyMonitor& safety, DataId id) : Procedure({}, 1), monitor(safety) { ask(id); }
    void answered(const Reply&) override {
      verdict = monitor.judge(request(), reply_bytes(), sent_at());
      finish(error_of(verdict.failed), text_of(verdict.failed).sentence);
    }
    void report(FieldSink&) const override {}
    SafetyMonitor& monitor;
    SafetyVerdict verdict;
  };
  for (const auto& [id, failed] :
       {std::pair{DataId::position, Check::sequence_unknown}, std::pair{DataId::singleturn, Check::passed},
        std::pair{DataId::position, Check::passed}, std::pair{DataId::position, Check::sequence_still}}) {
    OneRead read(monitor, id);
    bench.run(read);
    EXPECT_EQ(read.verdict.failed, failed);
    EXPECT_EQ(read.verdict.position.has_value(), failed == Check::passed);
    EXPECT_EQ(read.error(), failed == Check::passed ? Error::none : Error::sequence_mismatch);
    EXPECT_EQ(read.detail(), text_of(failed).sentence);
  }
}

TEST(EslHost, AProfileThatDoesNotFitIsNamed) {
  struct Row {
    const char* host;     // what the host believes
    const char* encoder;  // what the encoder is
    DataId id;
    const char* sentence;
  };
  for (const Row& row : {
           Row{"", "status_order=tformat", DataId::position, "status_order=tformat"},
           Row{"status_order=tformat", "", DataId::position, "status_order=document"},
           Row{"", "rs1_sc2=b0", DataId::position, "rs1_sc2=b0"},
           Row{"", "crc16_byte_order=high", DataId::position, "crc16_byte_order=high"},
           Row{"", "crc16_byte_order=table12", DataId::position, "crc16_byte_order=table12"},
           Row{"", "crc16_byte_order=high status_order=tformat", DataId::position,
               "crc16_byte_order=high status_order=tformat"},
           Row{"address=1", "address=1 parity_scope=all", DataId::position, "parity_scope=all"},
           Row{"", "idc_rs1=b0", DataId::clear_alarms, "idc_rs1=b0"},
           Row{"id6_rs=9", "", DataId::calibration, "id6_rs=16"},
       }) {
    const Profile encoder = to_profile(row.encoder);
    Bench bench(encoder);
    bench.shaft.put(0, 0xABCDEF);
    Read read(to_profile(row.host), row.id);
    EXPECT_NE(bench.run(read).error(), Error::none) << row.encoder;
    EXPECT_NE(read.detail().find(row.sentence), std::string_view::npos) << row.encoder << ": " << read.detail();
  }
}

TEST(EslHost, ANodeThatNeverStopsDoesNotHoldTheHost) {
  struct Shouting final : Machine<std::uint8_t> {
    void feed(const Event<std::uint8_t>& event) override { free = event.kind == Event<std::uint8_t>::Kind::sent; }
    Step<std::uint8_t> next(Time) override {
      if (!free) return {.at = never};
      free = false;
      return {.kind = Step<std::uint8_t>::Kind::transfer, .out = noise};
    }
    bool free = true;
    Wire noise = Wire(100, 0x55);
  } shouting;
  Bench bench;
  bench.line.attach(sim::Role::device, shouting);
  Read read({});
  EXPECT_EQ(bench.run(read).error(), Error::wrong_length);
  EXPECT_TRUE(bench.finished);
  EXPECT_NE(read.detail().find("without a pause"), std::string_view::npos) << read.detail();
  EXPECT_LE(bench.line.now(), 2 * noise_limit);
}

// ---- Resets

TEST(EslHost, Resets) {
  Bench bench;
  bench.shaft.put(12, 4'000'000);
  bench.encoder.raise_alarms(alarms::xc_error);
  Reset clear({}, DataId::clear_alarms);
  EXPECT_EQ(bench.run(clear).error(), Error::none) << clear.detail();
  EXPECT_EQ(clear.reading()->alarms, 0u);
  EXPECT_EQ(clear.reading()->multiturn, 12u);
  Reset zero({}, DataId::zero);
  EXPECT_EQ(bench.run(zero).error(), Error::none) << zero.detail();
  EXPECT_EQ(zero.reading()->singleturn, 0u);
  EXPECT_EQ(zero.reading()->multiturn, 12u);
  Reset turns({}, DataId::reset_multiturn);
  EXPECT_EQ(bench.run(turns).error(), Error::none) << turns.detail();
  EXPECT_EQ(turns.reading()->multiturn, 0u);
  EXPECT_EQ(turns.reading()->singleturn, 0u);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
  // The zero survives power off, in both channels.
  bench.encoder.power_off(bench.line.now());
  bench.encoder.power_on(bench.line.now(), Device<std::uint8_t>::PowerOn::skip);
  EXPECT_EQ(bench.read().singleturn, 0u);
  EXPECT_EQ(bench.read().redundant, 0u);
  EXPECT_EQ(bench.read().multiturn, 0u);
}

TEST(EslHost, ResetRequestsAre40MicrosecondsApart) {
  Bench bench;
  std::vector<Time> starts;
  bench.line.observe([&starts](auto sender, Time start, Time, std::uint8_t byte) {
    if (sender == 1 && byte == control_field({}, 0, DataId::zero)) starts.push_back(start);
  });
  Reset zero({}, DataId::zero);
  bench.run(zero);
  ASSERT_EQ(starts.size(), 8u);
  for (std::size_t i = 1; i < 8; ++i) EXPECT_EQ(starts[i] - starts[i - 1], reset_interval);
}

TEST(EslHost, WhatCannotBeClearedIsNamed) {
  struct Row {
    std::uint8_t raised;
    const char* sentence;
  };
  for (const Row& row :
       {Row{alarms::overspeed, "overspeed remains; switch the encoder off and on"},
        Row{alarms::multiturn_error, "multiturn_error remains; multiturn_error: reset-multiturn first"},
        Row{alarms::under_voltage, "under_voltage remains; the supply voltage is wrong"},
        Row{alarms::memory_error | alarms::singleturn_error | alarms::xc_error,
            "memory_error, singleturn_error remain; switch the encoder off and on"}}) {
    Bench bench;
    bench.encoder.raise_alarms(row.raised);
    Reset clear({}, DataId::clear_alarms);
    EXPECT_EQ(bench.run(clear).error(), Error::cross_check_failed);
    EXPECT_EQ(clear.detail(), row.sentence);
    EXPECT_EQ(clear.remaining(), row.raised & ~alarms::xc_error);
  }
}

TEST(EslHost, AMultiturnErrorNeedsDThenC) {
  Bench bench;
  bench.shaft.put(7, 100);
  bench.encoder.raise_alarms(alarms::multiturn_error);
  Reset turns({}, DataId::reset_multiturn);
  EXPECT_EQ(bench.run(turns).error(), Error::none);
  EXPECT_EQ(turns.remaining(), alarms::multiturn_error);
  Reset clear({}, DataId::clear_alarms);
  EXPECT_EQ(bench.run(clear).error(), Error::none);
  EXPECT_EQ(clear.remaining(), 0);
}

TEST(EslHost, AnIdDThatMovesTheSingleTurnZeroIsFound) {
  Bench bench;
  bench.shaft.put(7, 1'000'000);
  bench.encoder.set_environment({.d_clears_singleturn = true});
  Reset turns({}, DataId::reset_multiturn);
  EXPECT_EQ(bench.run(turns).error(), Error::cross_check_failed);
  EXPECT_NE(turns.detail().find("single-turn zero too"), std::string_view::npos);
}

TEST(EslHost, AResetOnATurningShaftOrAStartingEncoderIsNotSent) {
  for (const std::int32_t rpm : {5, -5}) {
    Bench bench;
    bench.shaft.spin(rpm, Time{});
    Reset zero({}, DataId::zero);
    EXPECT_EQ(bench.run(zero).error(), Error::invalid_argument);
    EXPECT_EQ(bench.encoder.answered(), 2u);  // it only looked
  }
  Bench starting;
  starting.encoder.power_off(Time{});
  starting.encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::real);
  Reset zero({}, DataId::zero);
  EXPECT_EQ(starting.run(zero).error(), Error::invalid_argument);
  EXPECT_NE(zero.detail().find("not ready"), std::string_view::npos);
}

TEST(EslHost, ALostReplyStopsAResetUnlessItIsTheLast) {
  // Replies 0 and 1 are looks; the requests are 2 to 9.
  for (const unsigned lost : {5u, 9u}) {
    Bench bench({}, [lost](unsigned index, Wire& reply) {
      if (index == lost) reply.pop_back();
    });
    bench.shaft.put(5, 0);
    Reset reset({}, DataId::reset_multiturn);
    EXPECT_EQ(bench.run(reset).error(), lost == 9 ? Error::none : Error::wrong_length);
    EXPECT_EQ(bench.encoder.reply_to(DataId::position, bench.line.now()).multiturn, lost == 9 ? 0u : 5u);
  }
}

// Replies 0 and 1 are looks, 2 to 9 answer the requests, 10 is the verification.
TEST(EslHost, AResetThatDidNotHappenIsFound) {
  for (const DataId id : {DataId::zero, DataId::reset_multiturn}) {
    Bench bench({}, [](unsigned index, Wire& reply) {
      Reply stale{.one = {.status = status::ready}, .two = {.status = status::ready | status::channel_2}};
      stale.singleturn = (1 << 14) + 1;
      stale.multiturn = 1;
      if (index == 10) reply = wire(encode_reply({}, stale));
    });
    Reset reset({}, id);
    EXPECT_EQ(bench.run(reset).error(), Error::cross_check_failed);
    EXPECT_EQ(reset.reading(), nullptr);
  }
}

}  // namespace
}  // namespace absenc::esl
