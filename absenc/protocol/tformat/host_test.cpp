// SPDX-License-Identifier: Apache-2.0
// Positions and the commands of the unit against the virtual Smart-Abs in virtual time.
#include "absenc/protocol/tformat/host.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/tformat/bench_test.hpp"

namespace absenc::tformat {
namespace {

using testing::Bench;
using testing::Numbers;
using testing::PowerOn;
using testing::Tamper;
using testing::wire;
using testing::Wire;

bool has(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

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
  EXPECT_EQ(bench.command("position").numbers, (Numbers{{"data_id", 3},
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
  const auto id = bench.command("encoder-id");
  EXPECT_FALSE(id.reading);
  EXPECT_EQ(id.numbers.at("encoder_id"), 0x11);
}

TEST(TformatHost, ReadsA23BitEncoderAndRefusesTheWrongModel) {
  const Format bits_23{.singleturn_bits = 23, .encoder_id = 0x17};
  testing::TestShaft shaft;
  shaft.put(1, 0x1FFFF);
  VirtualEncoder encoder(bits_23, shaft);
  encoder.power_on(Time{}, PowerOn::skip);
  sim::Line<std::uint8_t> line(LinkKind::half_duplex, line_settings);
  line.attach(sim::Role::device, encoder);
  ReadPosition read(bits_23);
  const auto host = line.attach(sim::Role::host, read);
  ASSERT_TRUE(line.run(host));
  EXPECT_EQ(read.reading()->singleturn, 0x1FFFFull << 6);
  ReadPosition wrong({.encoder_id = 0x11});
  line.replace(host, wrong);
  ASSERT_TRUE(line.run(host));
  EXPECT_EQ(wrong.error(), Error::unexpected_reply);
  EXPECT_EQ(wrong.reading(), nullptr);
  EXPECT_EQ(wrong.exchange().received.size(), 11u);
}

TEST(TformatHost, SilenceIsATimeoutAndNothingIsRepeated) {
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
    Tamper tamper;
    Error error;
  };
  for (const Row& row : std::vector<Row>{
           {"checksum", [](unsigned, Wire& reply) { reply[4] ^= 1; }, Error::bad_checksum},
           {"cut", [](unsigned, Wire& reply) { reply.pop_back(); }, Error::wrong_length},
           {"too long", [](unsigned, Wire& reply) { reply.insert(reply.begin(), 0x1A); }, Error::wrong_length},
           {"twice", [](unsigned, Wire& reply) { reply.insert(reply.begin(), reply.begin(), reply.begin() + 5); },
            Error::wrong_length},
           {"other id", [](unsigned, Wire& reply) { reply[0] = 0x02, reply[10] ^= 0x18; }, Error::unexpected_reply}}) {
    Bench bench(row.tamper);
    ReadPosition read({});
    EXPECT_EQ(bench.run(read).error(), row.error) << row.what;
    EXPECT_EQ(read.reading(), nullptr) << row.what;
    EXPECT_GE(bench.line.now(), read.exchange().received_at + gap_limit) << row.what;
    EXPECT_EQ(bench.encoder.violation_count(), 0u) << row.what;
  }
}

// ---- Refusals (6.3.2)

Tamper refuse(unsigned from, unsigned to, std::uint8_t alarm) {
  return [=](unsigned index, Wire& reply) {
    if (index >= from && index < to) reply = wire(Reply{.status = alarm, .encoder_id = 0x11});
  };
}

// ca0 and ca1 by name, what else is answered so, and what to do.
TEST(TformatHost, ARefusalIsExplained) {
  struct Row {
    std::uint8_t alarm;
    std::string_view command;
    std::string_view found;
    bool again;
  };
  for (const Row& row : {Row{status::parity_error, "position", "ca0: it received", true},
                         Row{status::delimiter_error, "position", "ca1: it received a damaged character", true},
                         Row{status::rejected, "encoder-id", "ca0 and ca1", true},
                         Row{0, "encoder-id", "without a communication alarm", false}}) {
    Bench bench(refuse(0, 9, row.alarm));
    const auto read = bench.command(row.command);
    EXPECT_EQ(read.error, Error::request_rejected);
    EXPECT_TRUE(has(read.detail, row.found)) << read.detail;
    EXPECT_EQ(read.advice.starts_with("send the same request again"), row.again);
    EXPECT_EQ(read.advice.empty(), !row.again);
    EXPECT_EQ(bench.encoder.answered(), 1u);
  }
  Bench middle(refuse(5, 6, status::parity_error));
  const auto reset = middle.command("clear-alarms");
  EXPECT_EQ(reset.error, Error::request_rejected);
  EXPECT_TRUE(has(reset.detail, "ca0: ")) << reset.detail;
  EXPECT_TRUE(has(reset.detail, "; one of the ten requests")) << reset.detail;
}

TEST(TformatHost, ARefusedRequestIsSentAgainInsideProcedures) {
  Bench bench(refuse(2, 3, status::parity_error));  // the read behind the page select
  const auto read = bench.command("temperature");
  EXPECT_EQ(read.error, Error::none);
  EXPECT_EQ(read.numbers, (Numbers{{"temperature_c", 35}}));
}

// ---- Memory

std::uint8_t selected_page(Bench& bench) { return bench.raw({0xEA, 0x7F, 0x95})[2]; }

TEST(TformatHost, ThePageThatADriveHadSelectedIsRestored) {
  for (const std::uint8_t before : std::to_array<std::uint8_t>({0, 3, 7})) {
    Bench bench;
    bench.raw(wire(Request{DataId::write_memory, page_select_address, before}));
    bench.pass(memory_time);
    EXPECT_EQ(bench.command("temperature").numbers, (Numbers{{"temperature_c", 35}}));
    EXPECT_EQ(selected_page(bench), before);
    EXPECT_EQ(bench.command("overheat-threshold").error, Error::none);
    EXPECT_EQ(selected_page(bench), before);
    EXPECT_EQ(bench.command("set-overheat-threshold", {80}).numbers,
              (Numbers{{"overheat_enabled", 1}, {"overheat_threshold_c", 80}, {"written", 1}}));
    EXPECT_EQ(selected_page(bench), before);
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

TEST(TformatHost, APageThatStaysSelectedIsTold) {
  // An encoder that refuses to say which page is selected, as it does with a closed address (9.4).
  Bench refusing(refuse(0, 3, 0));
  EXPECT_EQ(refusing.command("temperature").numbers, (Numbers{{"temperature_c", 35}, {"page_left", 7}}));
  struct Row {
    unsigned lost;  // from this reply on: page, page select, temperature, page select, page
    Error error;
    bool left;
  };
  for (const Row& row : {Row{1, Error::timeout, true}, Row{2, Error::timeout, true}, Row{3, Error::none, true},
                         Row{4, Error::none, true}, Row{5, Error::none, false}}) {
    Bench bench([&](unsigned index, Wire& reply) {
      if (index >= row.lost) reply.clear();
    });
    const auto lost = bench.command("temperature");
    EXPECT_EQ(lost.error, row.error) << row.lost;
    EXPECT_EQ(has(lost.detail, "page 7 may be left selected"), row.error != Error::none) << lost.detail;
    EXPECT_EQ(lost.numbers.contains("page_left"), row.left && row.error == Error::none) << row.lost;
    // A page change that may be going on is over when the next one asks.
    const Wire answer = bench.raw({0xEA, 0x7F, 0x95});
    EXPECT_EQ(bench.encoder.violation_count(), 0u) << row.lost;
  }
}

TEST(TformatHost, WhatIsLeftByOneThatIsBrokenOff) {
  for (const auto& [name, time, left] :
       {std::tuple{"temperature", 10us, false}, {"temperature", 200us, true}, {"zero", 200us, false}}) {
    Bench bench;
    auto& conversation = bench.make(name);
    bench.put_on(conversation);
    bench.pass(time);
    testing::Collector collector;
    conversation.report_left(collector);
    EXPECT_EQ(collector.numbers, left ? (Numbers{{"page_left", 7}}) : Numbers{}) << name << time.count();
  }
}

TEST(TformatHost, TemperatureAndItsThreshold) {
  Bench bench;
  bench.set(temperature, -10);
  EXPECT_EQ(bench.command("temperature").numbers.at("temperature_c"), -10);
  EXPECT_EQ(bench.command("overheat-threshold").numbers,
            (Numbers{{"overheat_enabled", 1}, {"overheat_threshold_c", 90}}));
  bench.set(temperature, 31);
  EXPECT_EQ(bench.command("set-overheat-threshold", {31}).numbers.at("overheat_threshold_c"), 31);
  EXPECT_EQ(bench.everything().alarms, 0);
  bench.command("set-overheat-threshold", {30});
  EXPECT_EQ(bench.everything().alarms, alarms::over_heat);
  EXPECT_EQ(bench.command("set-overheat-threshold", {0}).numbers, (Numbers{{"overheat_enabled", 0}, {"written", 1}}));
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(TformatHost, MemoryIsWrittenReadBackAndSparedWear) {
  Bench bench;
  EXPECT_EQ(bench.command("memory-write", {126, 0x5A, 3}).numbers,
            (Numbers{{"page", 3}, {"address", 126}, {"value", 0x5A}, {"written", 1}}));
  EXPECT_EQ(bench.command("memory-write", {126, 0x5A, 3}).numbers.at("written"), 0);
  EXPECT_EQ(bench.encoder.writes(), 1u);
  EXPECT_EQ(bench.encoder.memory()[3 * 127 + 126], 0x5A);
  EXPECT_EQ(bench.command("memory-read", {126, 3, 1}).numbers,
            (Numbers{{"page", 3}, {"address", 126}, {"value", 0x5A}}));
  EXPECT_EQ(bench.command("memory-read", {120, 3, 7}).numbers.count("data"), 1u);
  EXPECT_EQ(selected_page(bench), 3);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(TformatHost, ClosedMemoryIsRefusedBeforeAnythingIsSent) {
  Bench bench;
  for (const auto& [name, arguments] : {std::pair<const char*, std::vector<std::int64_t>>{"memory-read", {0, 6, 1}},
                                        {"memory-read", {126, 0, 2}},
                                        {"memory-read", {3, 7, 1}},
                                        {"memory-write", {127, 1, 0}},
                                        {"memory-write", {0, 1, 6}},
                                        {"memory-write", {5, 1, 7}}}) {
    const auto closed = bench.command(name, arguments);
    EXPECT_EQ(closed.error, Error::invalid_argument) << name << arguments[0];
    EXPECT_TRUE(has(closed.detail, "pages 0 to 5")) << closed.detail;
  }
  EXPECT_EQ(bench.encoder.answered(), 0u);
}

// Replies: page select, read, write, page select, read.
TEST(TformatHost, AWriteIsJudgedByReadingBackAndNeverRepeated) {
  struct Row {
    const char* what;
    Tamper tamper;
    Error error;
    std::string_view detail;
    unsigned writes;
  };
  for (const Row& row : std::vector<Row>{
           {"its reply is lost",
            [](unsigned i, Wire&reply) {
              if (i == 2) reply.pop_back();
            },
            Error::none, "", 1},
           {"it does not hold",
            [](unsigned i, Wire&reply) {
              if (i == 4) reply[2] = 0x32, reply[3] ^= 1;
            },
            Error::cross_check_failed, "the write has failed", 1},
           {"no page", [](unsigned, Wire&reply) { reply.clear(); }, Error::timeout, "nothing was written", 0},
           {"no look",
            [](unsigned i, Wire&reply) {
              if (i >= 1) reply.clear();
            },
            Error::timeout, "nothing was written", 0},
           {"no page after it",
            [](unsigned i, Wire&reply) {
              if (i >= 3) reply.clear();
            },
            Error::timeout, "was written, but could not be read back", 1},
           {"no read-back",
            [](unsigned i, Wire&reply) {
              if (i >= 4) reply.clear();
            },
            Error::timeout, "was written, but could not be read back", 1}}) {
    Bench bench(row.tamper);
    const auto write = bench.command("memory-write", {10, 0x33, 1});
    EXPECT_EQ(write.error, row.error) << row.what;
    EXPECT_TRUE(has(write.detail, row.detail)) << row.what << write.detail;
    EXPECT_EQ(bench.encoder.writes(), row.writes) << row.what;
    EXPECT_EQ(bench.encoder.violation_count(), 0u) << row.what;
  }
}

// Of a busy encoder, up to 36 ms: a read or write is asked again each millisecond, a page select after 18.
TEST(TformatHost, ABusyEncoderIsWaitedFor) {
  const auto busy = [](unsigned from, unsigned to) {
    return [=](unsigned index, Wire& reply) {
      if (index < from || index >= to) return;
      reply[1] |= busy_bit;
      reply[2] = 0;
      reply[3] = checksum(Bytes(reply).first(3));
    };
  };
  struct Row {
    unsigned from, to;
    Error error;
    Time least, most;
  };
  for (const Row& row : {Row{0, 1, Error::none, 36ms, 37ms}, Row{1, 21, Error::none, 38ms, 40ms},
                         Row{0, 99, Error::busy, 54ms, 73ms}, Row{1, 99, Error::busy, 54ms, 57ms}}) {
    Bench bench(busy(row.from, row.to));
    const auto read = bench.command("memory-read", {1, 0, 1});
    EXPECT_EQ(read.error, row.error) << row.from << row.to;
    EXPECT_EQ(has(read.detail, "stays busy"), row.error == Error::busy);
    EXPECT_GE(bench.line.now(), row.least) << row.from << row.to;
    EXPECT_LE(bench.line.now(), row.most) << row.from << row.to;
  }
  Bench writing(busy(2, 99));
  EXPECT_EQ(writing.command("memory-write", {1, 1, 0}).error, Error::busy);
}

// ---- Resets

TEST(TformatHost, Resets) {
  Bench bench;
  bench.shaft.put(12, 4000);
  bench.encoder.raise_alarms(alarms::over_speed | alarms::counter_overflow);
  const auto clear = bench.command("clear-alarms");
  EXPECT_EQ(clear.error, Error::none);
  EXPECT_EQ(clear.reading->alarms, 0u);
  EXPECT_EQ(clear.reading->multiturn, 12u);
  const auto zero = bench.command("zero");
  EXPECT_EQ(zero.error, Error::none);
  EXPECT_EQ(zero.reading->singleturn, 0u);
  EXPECT_EQ(zero.reading->multiturn, 12u);
  EXPECT_EQ(zero.reading->received, bench.line.now());
  EXPECT_EQ(zero.reading->latched, bench.line.now() - 47us);
  EXPECT_EQ(zero.numbers.at("singleturn"), 0);
  bench.encoder.raise_alarms(alarms::battery_error);
  const auto turns = bench.command("reset-multiturn");
  EXPECT_EQ(turns.error, Error::none);
  EXPECT_EQ(turns.reading->multiturn, 0u);
  EXPECT_EQ(turns.reading->alarms, 0u);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(TformatHost, AResetThatMustNotBeSentIsNot) {
  struct Row {
    std::string_view name;
    std::int32_t rpm;
    std::uint8_t alarm;
    std::string_view detail;
  };
  for (const Row& row :
       {Row{"zero", 5, 0, "turning"}, Row{"zero", -5, 0, "turning"}, Row{"clear-alarms", 1, 0, "turning"},
        Row{"zero", 0, alarms::full_absolute_status, "full_absolute_status"},
        Row{"clear-alarms", 0, alarms::battery_error, "reset-multiturn"}}) {
    Bench bench;
    bench.encoder.raise_alarms(row.alarm);
    bench.shaft.spin(row.rpm, Time{});
    const auto reset = bench.command(row.name);
    EXPECT_EQ(reset.error, Error::invalid_argument) << row.detail;
    EXPECT_TRUE(has(reset.detail, row.detail)) << reset.detail;
    EXPECT_EQ(bench.encoder.answered(), 2u);  // it only looked
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

// Replies 0 and 1 are looks, 2 to 11 answer the requests, 12 is the verification.
TEST(TformatHost, AResetThatDidNotHappenIsFound) {
  struct Row {
    std::string_view name;
    Reply verification;
    std::string_view detail;
  };
  for (const Row& row :
       {Row{"zero", {.singleturn = 128, .encoder_id = 0x11}, "not zero"},
        Row{"zero", {.singleturn = 0x20000 - 128, .encoder_id = 0x11}, "not zero"},
        Row{"zero", {.singleturn = 127, .encoder_id = 0x11}, ""},
        Row{"reset-multiturn", {.multiturn = 1, .encoder_id = 0x11}, "turns are still not zero"},
        Row{"reset-multiturn", {.encoder_id = 0x11, .alarms = alarms::over_speed}, "latched alarms remain"},
        Row{"clear-alarms", {.encoder_id = 0x11, .alarms = alarms::counter_overflow}, "latched alarms remain"},
        Row{"clear-alarms", {.status = status::alarm, .encoder_id = 0x11, .alarms = alarms::over_heat}, "cool down"},
        Row{"clear-alarms", {.status = status::alarm, .encoder_id = 0x11, .alarms = alarms::battery_alarm}, ""}}) {
    Bench bench([&row](unsigned index, Wire& reply) {
      if (index == 12) reply = wire(row.verification);
    });
    const auto reset = bench.command(row.name);
    EXPECT_EQ(reset.error, row.detail.empty() ? Error::none : Error::cross_check_failed) << row.name << row.detail;
    EXPECT_TRUE(has(reset.detail, row.detail)) << reset.detail;
    EXPECT_EQ(reset.reading.has_value(), row.detail.empty());
  }
}

TEST(TformatHost, ALostReplyStopsAResetUnlessItIsTheTenth) {
  const auto lose = [](unsigned from, unsigned to) {
    return [=](unsigned index, Wire& reply) {
      if (index >= from && index < to) reply.pop_back();
    };
  };
  struct Row {
    unsigned from, to;
    Error error;
    std::string_view detail;
    std::uint32_t turns;
  };
  for (const Row& row :
       {Row{7, 8, Error::wrong_length, "one of the ten requests", 5},
        Row{10, 11, Error::wrong_length, "one of the ten requests", 5}, Row{11, 12, Error::none, "", 0},
        Row{12, 15, Error::wrong_length, "whether the encoder obeyed could not be read", 0}}) {
    Bench bench(lose(row.from, row.to));
    bench.shaft.put(5, 0);
    const auto reset = bench.command("reset-multiturn");
    EXPECT_EQ(reset.error, row.error) << row.from;
    EXPECT_TRUE(has(reset.detail, row.detail)) << reset.detail;
    EXPECT_EQ(bench.encoder.everything(bench.line.now()).multiturn, row.turns) << row.from;
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

}  // namespace
}  // namespace absenc::tformat
