// SPDX-License-Identifier: Apache-2.0
// Host conversations against the virtual Smart-Abs in virtual time.
#include "absenc/protocol/tformat/host.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>

#include "absenc/protocol/tformat/bench_test.hpp"

namespace absenc::tformat {
namespace {

using testing::Bench;
using PowerOn = Device<std::uint8_t>::PowerOn;

std::map<std::string, std::int64_t> report(const Conversation<std::uint8_t>& conversation) {
  struct Collector final : FieldSink {
    void put(const FieldValue& value) override { fields[std::string(value.info->name)] = value.number; }
    std::map<std::string, std::int64_t> fields;
  } collector;
  conversation.report(collector);
  return collector.fields;
}

/// Answers the n-th request (from 0) as the script wants; what the script leaves alone is answered by a real encoder.
class Tampered final : public Machine<std::uint8_t> {
 public:
  using Tamper = std::function<void(unsigned index, std::vector<std::uint8_t>& reply)>;
  Tampered(VirtualEncoder& encoder, Tamper tamper) : encoder_(encoder), tamper_(std::move(tamper)) {}
  void feed(const Event<std::uint8_t>& event) override { encoder_.feed(event); }
  Step<std::uint8_t> next(Time now) override {
    Step<std::uint8_t> step = encoder_.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::transfer) {
      out_.assign(step.out.begin(), step.out.end());
      tamper_(replies_++, out_);
      step.out = out_;
    }
    return step;
  }

 private:
  VirtualEncoder& encoder_;
  Tamper tamper_;
  unsigned replies_ = 0;
  std::vector<std::uint8_t> out_;
};

/// An encoder on a line of its own, with a tampered wire.
struct TamperedBench {
  explicit TamperedBench(Tampered::Tamper tamper) : encoder({}, shaft), device(encoder, std::move(tamper)) {
    encoder.power_on(Time{}, PowerOn::skip);
    line.attach(sim::Role::device, device);
  }
  template <class Conversation>
  Conversation& run(Conversation& conversation) {
    const auto host = line.attach(sim::Role::host, conversation);
    EXPECT_TRUE(line.run(host, line.now() + 10s));
    return conversation;
  }
  testing::TestShaft shaft;
  VirtualEncoder encoder;
  Tampered device;
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
};

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
  EXPECT_EQ(report(read), (std::map<std::string, std::int64_t>{{"data_id", 3},
                                                               {"status", 0},
                                                               {"singleturn", 0x12345},
                                                               {"encoder_id", 17},
                                                               {"multiturn", 4660},
                                                               {"alarms", 0}}));
}

TEST(TformatHost, PartsAreReadWithWhatAlarmsSay) {
  Bench bench;
  bench.shaft.put(4660, 0x12345);
  ReadPosition first({}, DataId::singleturn);
  EXPECT_EQ(bench.run(first).reading()->singleturn, 0x12345u);
  EXPECT_TRUE(first.reading()->singleturn_valid());
  EXPECT_EQ(bench.encoder.answered(), 2u);  // ID 3 before it
  ReadPosition turns({}, DataId::multiturn, 0);
  EXPECT_EQ(bench.run(turns).reading()->multiturn, 4660u);
  EXPECT_EQ(bench.encoder.answered(), 3u);
  bench.encoder.raise_alarms(alarms::multiturn_error);
  ReadPosition alarmed({}, DataId::multiturn, 0);
  bench.run(alarmed);
  EXPECT_EQ(bench.encoder.answered(), 5u);  // followed by an ID 3
  EXPECT_FALSE(alarmed.reading()->multiturn_valid);
  EXPECT_EQ(alarmed.reading()->alarms, alarms::multiturn_error);
  ReadPosition id({}, DataId::encoder_id);
  bench.run(id);
  EXPECT_EQ(id.reading(), nullptr);
  EXPECT_EQ(report(id)["encoder_id"], 0x11);
}

TEST(TformatHost, ReadsA23BitEncoderAndRefusesTheWrongModel) {
  const Format bits_23{.singleturn_bits = 23, .encoder_id = 0x17};
  Bench bench(bits_23);
  bench.shaft.put(1, 0x1FFFF);
  ReadPosition read(bits_23);
  EXPECT_EQ(bench.run(read).reading()->singleturn, 0x1FFFFull << 6);
  ReadPosition wrong({});
  EXPECT_EQ(bench.run(wrong).error(), Error::unexpected_reply);
  EXPECT_EQ(wrong.reading(), nullptr);
  EXPECT_EQ(wrong.exchange().received.size(), 11u);
}

TEST(TformatHost, SilenceIsATimeout) {
  Bench bench;
  bench.encoder.power_off(Time{});
  ReadPosition read({});
  bench.run(read);
  EXPECT_EQ(read.error(), Error::timeout);
  EXPECT_EQ(bench.line.now(), 4us + answer_limit);
  EXPECT_EQ(read.exchange().sent.size(), 1u);
  EXPECT_TRUE(read.exchange().received.empty());
}

TEST(TformatHost, DamagedRepliesAreRefusedAfterSilence) {
  struct Row {
    const char* what;
    Tampered::Tamper tamper;
    Error error;
  };
  const std::vector<Row> rows{
      {"checksum", [](unsigned, auto& reply) { reply[4] ^= 1; }, Error::bad_checksum},
      {"cut", [](unsigned, auto& reply) { reply.pop_back(); }, Error::wrong_length},
      {"too long and wrong", [](unsigned, auto& reply) { reply.insert(reply.begin(), 0x1A); }, Error::wrong_length},
      {"twice", [](unsigned, auto& reply) { reply.insert(reply.begin(), reply.begin(), reply.begin() + 5); },
       Error::wrong_length},
      {"other id", [](unsigned, auto& reply) { reply[0] = 0x02, reply[10] ^= 0x18; }, Error::unexpected_reply},
  };
  for (const Row& row : rows) {
    TamperedBench bench(row.tamper);
    ReadPosition read({});
    EXPECT_EQ(bench.run(read).error(), row.error) << row.what;
    EXPECT_EQ(read.reading(), nullptr) << row.what;
    EXPECT_GE(bench.line.now(), read.exchange().received_at + gap_limit) << row.what;
    EXPECT_EQ(bench.encoder.violation_count(), 0u) << row.what;
  }
}

TEST(TformatHost, ARefusedRequestIsSentAgainInsideProcedures) {
  TamperedBench bench([](unsigned index, auto& reply) {
    if (index != 2) return;  // the read behind the page select
    const ReplyBytes refusal = encode_reply({.status = status::parity_error, .encoder_id = 0x11});
    reply.assign(refusal.view().begin(), refusal.view().end());
  });
  ReadTemperature read({});
  EXPECT_EQ(bench.run(read).error(), Error::none);
  EXPECT_EQ(report(read)["temperature_c"], 35);
}

// ca0 and ca1 by name, what else is answered so, and what to do (6.3.2).
TEST(TformatHost, ARefusalIsExplained) {
  struct Row {
    std::uint8_t alarm;
    DataId id;
    std::string_view found;
    std::string_view advice;
  };
  for (const Row& row :
       {Row{status::parity_error, DataId::everything, "ca0: it received", "send the same request again"},
        Row{status::delimiter_error, DataId::everything, "ca1: it received a damaged character",
            "send the same request again"},
        Row{status::rejected, DataId::encoder_id, "ca0 and ca1", "send the same request again"},
        Row{0, DataId::encoder_id, "without a communication alarm", ""}}) {
    TamperedBench bench([&](unsigned, auto& reply) {
      const ReplyBytes refusal = encode_reply({.status = row.alarm, .encoder_id = 0x11});
      reply.assign(refusal.view().begin(), refusal.view().end());
    });
    ReadPosition read({}, row.id);
    EXPECT_EQ(bench.run(read).error(), Error::request_rejected);
    EXPECT_NE(read.detail().find(row.found), std::string_view::npos) << read.detail();
    EXPECT_EQ(read.advice().substr(0, row.advice.size()), row.advice);
    EXPECT_EQ(read.advice().empty(), row.advice.empty());
  }
}

TEST(TformatHost, ARefusalInTheMiddleOfAResetIsExplainedToo) {
  TamperedBench bench([](unsigned index, auto& reply) {
    if (index < 5) return;
    const ReplyBytes refusal = encode_reply({.status = status::parity_error, .encoder_id = 0x11});
    reply.assign(refusal.view().begin(), refusal.view().end());
  });
  Reset reset({}, DataId::clear_alarms);
  EXPECT_EQ(bench.run(reset).error(), Error::request_rejected);
  EXPECT_NE(reset.detail().find("ca0: "), std::string_view::npos) << reset.detail();
  EXPECT_NE(reset.detail().find("one of the ten requests"), std::string_view::npos) << reset.detail();
}

std::uint8_t selected_page(Bench& bench) { return bench.raw({0xEA, 0x7F, 0x95})[2]; }

TEST(TformatHost, ThePageThatADriveHadSelectedIsRestored) {
  for (const std::uint8_t before : std::to_array<std::uint8_t>({0, 3, 7})) {
    Bench bench;
    bench.raw({0x32, 0x7F, before, static_cast<std::uint8_t>(0x32 ^ 0x7F ^ before)});
    bench.pass(memory_time);
    ReadTemperature temperature({});
    EXPECT_EQ(bench.run(temperature).error(), Error::none);
    EXPECT_EQ(report(temperature), (std::map<std::string, std::int64_t>{{"temperature_c", 35}}));
    EXPECT_EQ(selected_page(bench), before);
    ReadOverheatThreshold threshold({});
    EXPECT_EQ(bench.run(threshold).error(), Error::none);
    EXPECT_EQ(selected_page(bench), before);
    WriteOverheatThreshold write({}, 80);
    EXPECT_EQ(bench.run(write).error(), Error::none) << write.detail();
    EXPECT_EQ(report(write)["overheat_threshold_c"], 80);
    EXPECT_EQ(selected_page(bench), before);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

// An encoder that refuses to say which page is selected, as it does with a closed address (9.4).
TEST(TformatHost, APageThatStaysSelectedIsTold) {
  TamperedBench bench([](unsigned index, auto& reply) {
    if (index >= 3) return;
    const ReplyBytes refusal = encode_reply({.encoder_id = 0x11});
    reply.assign(refusal.view().begin(), refusal.view().end());
  });
  ReadTemperature temperature({});
  EXPECT_EQ(bench.run(temperature).error(), Error::none);
  EXPECT_EQ(report(temperature), (std::map<std::string, std::int64_t>{{"temperature_c", 35}, {"page_left", 7}}));

  TamperedBench silent([](unsigned index, auto& reply) {
    if (index > 1) reply.clear();  // from the read behind the page select on
  });
  ReadTemperature lost({});
  EXPECT_EQ(silent.run(lost).error(), Error::timeout);
  EXPECT_NE(lost.detail().find("page 7 may be left selected"), std::string_view::npos) << lost.detail();
}

TEST(TformatHost, TemperatureBelowZero) {
  Bench bench;
  bench.encoder.set_environment({.temperature = -10});
  ReadTemperature read({});
  bench.run(read);
  EXPECT_EQ(report(read)["temperature_c"], -10);
}

TEST(TformatHost, OverHeatThreshold) {
  Bench bench;
  ReadOverheatThreshold at_shipping({});
  bench.run(at_shipping);
  EXPECT_EQ(report(at_shipping),
            (std::map<std::string, std::int64_t>{{"overheat_enabled", 1}, {"overheat_threshold_c", 90}}));
  WriteOverheatThreshold write({}, 30);
  EXPECT_EQ(bench.run(write).error(), Error::none);
  EXPECT_EQ(report(write)["overheat_threshold_c"], 30);
  EXPECT_EQ(bench.everything().alarms, alarms::over_heat);  // it has 35
  WriteOverheatThreshold off({}, 0);
  EXPECT_EQ(bench.run(off).error(), Error::none);
  EXPECT_EQ(report(off)["overheat_enabled"], 0);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(TformatHost, MemoryIsWrittenReadBackAndSparedWear) {
  Bench bench;
  WriteMemory write({}, 3, 126, 0x5A);
  EXPECT_EQ(bench.run(write).error(), Error::none);
  EXPECT_TRUE(write.written());
  EXPECT_EQ(bench.encoder.writes(), 1u);
  WriteMemory same({}, 3, 126, 0x5A);
  EXPECT_EQ(bench.run(same).error(), Error::none);
  EXPECT_FALSE(same.written());
  EXPECT_EQ(bench.encoder.writes(), 1u);
  WriteMemory insist({}, 3, 126, 0x5A, Wear::accept);
  EXPECT_EQ(bench.run(insist).error(), Error::none);
  EXPECT_EQ(bench.encoder.writes(), 2u);
  ReadMemory read({}, 3, 120, 7);
  EXPECT_EQ(bench.run(read).error(), Error::none);
  ASSERT_EQ(read.data().size(), 7u);
  EXPECT_EQ(read.data()[6], 0x5A);
  EXPECT_EQ(read.data()[5], 0x00);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(TformatHost, ClosedMemoryIsRefusedBeforeAnythingIsSent) {
  Bench bench;
  ReadMemory page_6({}, 6, 0);
  EXPECT_EQ(bench.run(page_6).error(), Error::invalid_argument);
  ReadMemory past_the_end({}, 0, 126, 2);
  EXPECT_EQ(bench.run(past_the_end).error(), Error::invalid_argument);
  WriteMemory page_select({}, 0, 127, 1);
  EXPECT_EQ(bench.run(page_select).error(), Error::invalid_argument);
  WriteMemory temperature({}, 7, 5, 1);
  EXPECT_EQ(bench.run(temperature).error(), Error::invalid_argument);
  EXPECT_FALSE(temperature.detail().empty());
  EXPECT_EQ(bench.encoder.answered(), 0u);
}

TEST(TformatHost, AWriteWhoseReplyIsLostIsJudgedByReadingBack) {
  TamperedBench bench([](unsigned index, auto& reply) {
    if (index == 2) reply.pop_back();  // page select, read, write
  });
  WriteMemory write({}, 1, 10, 0x33);
  EXPECT_EQ(bench.run(write).error(), Error::none);
  EXPECT_EQ(bench.encoder.writes(), 1u);  // never repeated
}

TEST(TformatHost, AWriteThatDoesNotHoldIsFound) {
  TamperedBench bench([](unsigned index, auto& reply) {
    if (index == 4) reply[2] = 0x32, reply[3] ^= 0x33 ^ 0x32;  // the read-back
  });
  WriteMemory write({}, 1, 10, 0x33);
  EXPECT_EQ(bench.run(write).error(), Error::cross_check_failed);
  EXPECT_TRUE(write.written());
}

TEST(TformatHost, AnEncoderThatStaysBusyIsGivenUp) {
  TamperedBench bench([](unsigned, auto& reply) {
    reply[1] |= busy_bit;
    reply[2] = 0;
    reply[3] = checksum(Bytes(reply).first(3));
  });
  ReadMemory read({}, 0, 1);
  EXPECT_EQ(bench.run(read).error(), Error::busy);
  EXPECT_LT(bench.line.now(), 60ms);
}

TEST(TformatHost, Resets) {
  Bench bench;
  bench.shaft.put(12, 4000);
  bench.encoder.raise_alarms(alarms::over_speed | alarms::counter_overflow);
  Reset clear({}, DataId::clear_alarms);
  EXPECT_EQ(bench.run(clear).error(), Error::none);
  EXPECT_EQ(clear.reading()->alarms, 0u);
  EXPECT_EQ(clear.reading()->multiturn, 12u);
  Reset zero({}, DataId::zero);
  EXPECT_EQ(bench.run(zero).error(), Error::none);
  EXPECT_EQ(zero.reading()->singleturn, 0u);
  EXPECT_EQ(zero.reading()->multiturn, 12u);
  bench.encoder.raise_alarms(alarms::battery_error);
  Reset turns({}, DataId::reset_multiturn);
  EXPECT_EQ(bench.run(turns).error(), Error::none);
  EXPECT_EQ(turns.reading()->multiturn, 0u);
  EXPECT_EQ(turns.reading()->alarms, 0u);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(TformatHost, AResetOnATurningShaftIsNotSent) {
  for (const std::int32_t rpm : {5, -5}) {
    Bench bench;
    bench.shaft.spin(rpm, Time{});
    Reset zero({}, DataId::zero);
    EXPECT_EQ(bench.run(zero).error(), Error::invalid_argument);
    EXPECT_EQ(bench.encoder.answered(), 2u);  // it only looked
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

// Replies 0 and 1 are looks, 2 to 11 answer the requests, 12 is the verification.
TEST(TformatHost, AResetThatDidNotHappenIsFound) {
  struct Row {
    DataId id;
    Reply verification;
  };
  for (const Row& row : {Row{DataId::zero, {.singleturn = 128, .encoder_id = 0x11}},
                         Row{DataId::zero, {.singleturn = 0x20000 - 128, .encoder_id = 0x11}},
                         Row{DataId::reset_multiturn, {.multiturn = 1, .encoder_id = 0x11}},
                         Row{DataId::clear_alarms, {.encoder_id = 0x11, .alarms = alarms::over_speed}}}) {
    TamperedBench bench([&row](unsigned index, auto& reply) {
      const ReplyBytes bytes = encode_reply(row.verification);
      if (index == 12) reply.assign(bytes.view().begin(), bytes.view().end());
    });
    Reset reset({}, row.id);
    EXPECT_EQ(bench.run(reset).error(), Error::cross_check_failed) << static_cast<int>(row.id);
    EXPECT_EQ(reset.reading(), nullptr);
  }
}

TEST(TformatHost, AResetNeedsAPositionFineEnoughToShowMovement) {
  Bench bench;
  bench.encoder.power_off(Time{});
  bench.shaft.spin(100, Time{});
  bench.encoder.power_on(Time{}, PowerOn::skip);
  Reset zero({}, DataId::zero);
  EXPECT_EQ(bench.run(zero).error(), Error::invalid_argument);
  EXPECT_EQ(bench.encoder.answered(), 2u);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(TformatHost, ClearingAlarmsDoesNotHideLostTurns) {
  Bench bench;
  bench.encoder.raise_alarms(alarms::battery_error);
  Reset clear({}, DataId::clear_alarms);
  EXPECT_EQ(bench.run(clear).error(), Error::invalid_argument);
  EXPECT_NE(clear.detail().find("reset-multiturn"), std::string_view::npos);
  EXPECT_EQ(bench.everything().alarms, alarms::battery_error);
}

TEST(TformatHost, AnEncoderStillTooHotIsNamed) {
  Bench bench;
  bench.encoder.set_environment({.temperature = 100});
  Reset clear({}, DataId::clear_alarms);
  EXPECT_EQ(bench.run(clear).error(), Error::cross_check_failed);
  EXPECT_NE(clear.detail().find("over_heat"), std::string_view::npos);
}

TEST(TformatHost, ALostReplyStopsAResetUnlessItIsTheTenth) {
  // Replies 0 and 1 are looks; the requests are 2 to 11.
  TamperedBench middle([](unsigned index, auto& reply) {
    if (index == 7) reply.pop_back();
  });
  middle.shaft.put(5, 0);
  Reset stopped({}, DataId::reset_multiturn);
  EXPECT_EQ(middle.run(stopped).error(), Error::wrong_length);
  EXPECT_EQ(middle.encoder.everything(middle.line.now()).multiturn, 5u);

  TamperedBench last([](unsigned index, auto& reply) {
    if (index == 11) reply.pop_back();
  });
  last.shaft.put(5, 0);
  Reset done({}, DataId::reset_multiturn);
  EXPECT_EQ(last.run(done).error(), Error::none);
  EXPECT_EQ(done.reading()->multiturn, 0u);
}

}  // namespace
}  // namespace absenc::tformat
