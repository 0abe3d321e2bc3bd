// SPDX-License-Identifier: Apache-2.0
// Tests of commands with several requests, with the virtual Smart-Abs in virtual time.
#include <gtest/gtest.h>

#include "absenc/protocol/tformat/bench_test.hpp"

namespace absenc::tformat {
namespace {

using testing::Bench;
using testing::Numbers;
using testing::refuse;
using testing::Tamper;
using testing::wire;
using testing::Wire;

// ---- Memory

std::uint8_t selected_page(Bench& bench) { return bench.raw({0xEA, 0x7F, 0x95})[2]; }

TEST(TformatProcedures, RestoresThePageBefore) {
  for (const std::uint8_t before : std::to_array<std::uint8_t>({0, 3, 7})) {
    Bench bench;
    bench.raw(wire(Request{DataId::write_memory, page_select_address, before}));
    bench.pass(memory_time);
    EXPECT_EQ(bench.run("temperature").numbers, (Numbers{{"temperature_c", 35}}));
    EXPECT_EQ(selected_page(bench), before);
    EXPECT_EQ(bench.run("overheat-threshold").error, Error::none);
    EXPECT_EQ(selected_page(bench), before);
    EXPECT_EQ(bench.run("set-overheat-threshold", {80}).numbers,
              (Numbers{{"overheat_enabled", 1}, {"overheat_threshold_c", 80}, {"written", 1}}));
    EXPECT_EQ(selected_page(bench), before);
    EXPECT_EQ(bench.violations(), 0u);
  }
}

TEST(TformatProcedures, ReportsPageThatStaysSelected) {
  // The encoder refuses to report which page is selected, as it refuses to read a closed address (9.4).
  Bench refusing(refuse(0, 3, 0));
  EXPECT_EQ(refusing.run("temperature").numbers, (Numbers{{"temperature_c", 35}, {"page_left", 7}}));
  // The encoder reports as selected a page that does not exist.
  Bench odd([](unsigned index, Wire& reply) {
    if (index == 0) reply = wire(Reply{.id = DataId::read_memory, .address = page_select_address, .value = 9});
  });
  EXPECT_EQ(odd.run("temperature").numbers, (Numbers{{"temperature_c", 35}, {"page_left", 7}}));
  EXPECT_EQ(odd.encoder.answer_count(), 3u);
  // At the end the encoder reports another page than the one that the host selected again.
  Bench other([](unsigned index, Wire& reply) {
    if (index == 4) reply = wire(Reply{.id = DataId::read_memory, .address = page_select_address, .value = 3});
  });
  EXPECT_EQ(other.run("temperature").numbers, (Numbers{{"temperature_c", 35}, {"page_left", 7}}));
  struct Row {
    // number of the first lost reply, of the five replies to: page, page select, temperature, page select, page
    unsigned lost;
    Error error;
    bool left;
  };
  for (const Row& row : {Row{1, Error::timeout, true}, Row{2, Error::timeout, true}, Row{3, Error::none, true},
                         Row{4, Error::none, true}, Row{5, Error::none, false}}) {
    Bench bench([&](unsigned index, Wire& reply) {
      if (index >= row.lost) reply.clear();
    });
    const auto lost = bench.run("temperature");
    EXPECT_EQ(lost.error, row.error) << row.lost;
    EXPECT_EQ(lost.says("page 7 may be left selected"), row.error != Error::none) << lost.detail;
    EXPECT_EQ(lost.numbers.contains("page_left"), row.left && row.error == Error::none) << row.lost;
    // The host has waited for the end of a page change that may have been in progress, so this request breaks no rule.
    const Wire answer = bench.raw({0xEA, 0x7F, 0x95});
    EXPECT_EQ(bench.violations(), 0u) << row.lost;
  }
}

TEST(TformatProcedures, ReportsWhatAnInterruptedProcedureLeaves) {
  for (const auto& [name, time, left] :
       {std::tuple{"temperature", 10us, false}, {"temperature", 200us, true}, {"zero", 200us, false}}) {
    Bench bench;
    const testing::Talk made(unit, bench.options, name);
    bench.line.put_on(*made);
    bench.pass(time);
    testing::RunResult told;
    made->report_left(told);
    EXPECT_EQ(told.numbers, left ? (Numbers{{"page_left", 7}}) : Numbers{}) << name << time.count();
  }
}

TEST(TformatProcedures, TemperatureAndItsThreshold) {
  Bench bench;
  bench.condition(temperature, -10);
  EXPECT_EQ(bench.run("temperature").numbers.at("temperature_c"), -10);
  EXPECT_EQ(bench.run("overheat-threshold").numbers, (Numbers{{"overheat_enabled", 1}, {"overheat_threshold_c", 90}}));
  bench.condition(temperature, 31);
  EXPECT_EQ(bench.run("set-overheat-threshold", {31}).numbers.at("overheat_threshold_c"), 31);
  EXPECT_EQ(bench.everything().alarms, 0);
  bench.run("set-overheat-threshold", {30});
  EXPECT_EQ(bench.everything().alarms, alarms::over_heat);
  EXPECT_EQ(bench.run("set-overheat-threshold", {0}).numbers, (Numbers{{"overheat_enabled", 0}, {"written", 1}}));
  EXPECT_EQ(bench.run("clear-alarms").error, Error::none);
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(TformatProcedures, WritesMemoryOnlyIfItDiffersAndReadsItBack) {
  Bench bench;
  EXPECT_EQ(bench.run("memory-write", {126, 0x5A, 3}).numbers,
            (Numbers{{"page", 3}, {"address", 126}, {"value", 0x5A}, {"written", 1}}));
  EXPECT_EQ(bench.run("memory-write", {126, 0x5A, 3}).numbers.at("written"), 0);
  EXPECT_EQ(bench.encoder.writes(), 1u);
  EXPECT_EQ(bench.encoder.memory()[3 * 127 + 126], 0x5A);
  EXPECT_EQ(bench.run("memory-read", {126, 3, 1}).numbers, (Numbers{{"page", 3}, {"address", 126}, {"value", 0x5A}}));
  EXPECT_EQ(bench.run("memory-read", {120, 3, 7}).numbers.count("data"), 1u);
  EXPECT_EQ(selected_page(bench), 3);
  EXPECT_EQ(bench.violations(), 0u);
}

// Memory byte of the over-heat threshold: bit 7 enables the threshold, which must then be 1 degC or more; with bit 7
// clear the threshold is off (7.2.4, 7.4).
TEST(TformatProcedures, RefusesOverHeatThresholdOfZeroDegrees) {
  Bench bench;
  const auto zero = bench.run("memory-write", {overheat_address, 0x80, service_page});
  EXPECT_EQ(zero.error, Error::invalid_argument);
  EXPECT_TRUE(zero.says("0x80 watches for 0 degC")) << zero.detail;
  EXPECT_EQ(bench.encoder.answer_count(), 0u);
  for (const std::int64_t value : {0x81, 0xFF, 0x00, 0x7F}) {
    EXPECT_EQ(bench.run("memory-write", {overheat_address, value, service_page}).error, Error::none) << value;
  }
  // The byte 0x80 is invalid as an over-heat threshold, but valid on a page for users.
  EXPECT_EQ(bench.run("memory-write", {overheat_address, 0x80, 0}).error, Error::none);
}

TEST(TformatProcedures, RefusesClosedMemoryBeforeSending) {
  Bench bench;
  for (const auto& [name, arguments] : {std::pair<const char*, std::vector<std::int64_t>>{"memory-read", {0, 6, 1}},
                                        {"memory-read", {126, 0, 2}},
                                        {"memory-read", {3, 7, 1}},
                                        {"memory-write", {127, 1, 0}},
                                        {"memory-write", {0, 1, 6}},
                                        {"memory-write", {5, 1, 7}}}) {
    const auto closed = bench.run(name, arguments);
    EXPECT_EQ(closed.error, Error::invalid_argument) << name << arguments[0];
    EXPECT_TRUE(closed.says(arguments[0] == 127 ? "outside its range" : "pages 0 to 5")) << closed.detail;
  }
  EXPECT_EQ(bench.encoder.answer_count(), 0u);
}

// Without faults, the command memory-write sends the requests page select, read, write, page select, read.
TEST(TformatProcedures, VerifiesWritesByReadingBackAndNeverRepeatsThem) {
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
    const auto write = bench.run("memory-write", {10, 0x33, 1});
    EXPECT_EQ(write.error, row.error) << row.what;
    EXPECT_TRUE(write.says(row.detail)) << row.what << write.detail;
    EXPECT_EQ(bench.encoder.writes(), row.writes) << row.what;
    EXPECT_EQ(bench.violations(), 0u) << row.what;
  }
}

TEST(TformatProcedures, WaitsForABusyEncoder) {
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
    const auto read = bench.run("memory-read", {1, 0, 1});
    EXPECT_EQ(read.error, row.error) << row.from << row.to;
    EXPECT_EQ(read.says("stays busy"), row.error == Error::busy);
    EXPECT_GE(bench.line.now(), row.least) << row.from << row.to;
    EXPECT_LE(bench.line.now(), row.most) << row.from << row.to;
    EXPECT_EQ(bench.violations(), 0u);  // the host sends nothing during a page change
  }
  Bench writing(busy(2, 99));
  EXPECT_EQ(writing.run("memory-write", {1, 1, 0}).error, Error::busy);
  EXPECT_LE(writing.line.now(), 95ms);  // after a busy timeout no other request is sent
}

// ---- Resets

TEST(TformatProcedures, Resets) {
  Bench bench;
  bench.shaft.put(12, 4000);
  bench.encoder.raise_alarms(alarms::over_speed | alarms::counter_overflow);
  const auto clear = bench.run("clear-alarms");
  EXPECT_EQ(clear.error, Error::none);
  EXPECT_EQ(clear.reading->alarms, 0u);
  EXPECT_EQ(clear.reading->multiturn, 12u);
  const auto zero = bench.run("zero");
  EXPECT_EQ(zero.error, Error::none);
  EXPECT_EQ(zero.reading->singleturn, 0u);
  EXPECT_EQ(zero.reading->multiturn, 12u);
  EXPECT_EQ(zero.reading->received, bench.line.now());
  EXPECT_EQ(zero.reading->latched, bench.line.now() - 47us);
  EXPECT_EQ(zero.numbers.at("singleturn"), 0);
  bench.encoder.raise_alarms(alarms::battery_error);
  const auto turns = bench.run("reset-multiturn");
  EXPECT_EQ(turns.error, Error::none);
  EXPECT_EQ(turns.reading->multiturn, 0u);
  EXPECT_EQ(turns.reading->alarms, 0u);
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(TformatProcedures, SendsNoForbiddenReset) {
  struct Row {
    std::string_view name;
    std::int32_t rpm;
    std::uint8_t alarm;
    std::string_view detail;
  };
  for (const Row& row : {Row{"zero", 5, 0, "nothing was changed"}, Row{"zero", -5, 0, "nothing was changed"},
                         Row{"clear-alarms", 1, 0, "nothing was changed"},
                         Row{"zero", 0, alarms::full_absolute_status, "full_absolute_status"},
                         Row{"zero", 0, alarms::counting_error, "does not hold"},
                         Row{"clear-alarms", 0, alarms::battery_error, "the turns are lost"}}) {
    Bench bench;
    bench.encoder.raise_alarms(row.alarm);
    bench.shaft.spin(row.rpm, Time{});
    const auto reset = bench.run(row.name);
    EXPECT_EQ(reset.error, row.rpm != 0 ? Error::not_still : Error::invalid_argument) << row.detail;
    EXPECT_TRUE(reset.says(row.detail)) << reset.detail;
    // The error not_still has general advice, so the command adds no advice of its own.
    EXPECT_EQ(reset.advice.empty(), row.rpm != 0) << row.detail;
    // The host requested two positions and sent no reset.
    EXPECT_EQ(bench.encoder.answer_count(), 2u);
    EXPECT_EQ(bench.violations(), 0u);
  }
}

TEST(TformatProcedures, EncoderWithoutBatteryIsDeclared) {
  Bench bench;
  bench.shaft.put(7, 1000);
  bench.condition(battery_voltage, 0);
  bench.restart();
  const auto taken = bench.run("position");
  EXPECT_EQ(taken.reading->alarms, unsigned{alarms::without_battery});
  EXPECT_EQ(taken.reading->multiturn_validity(), Validity::invalid);
  bench.tell("battery=false");
  const auto declared = bench.run("position");
  EXPECT_EQ(declared.reading->alarms, 0u);
  EXPECT_EQ(declared.reading->alarms_reported, 0xFFu ^ alarms::without_battery);
  EXPECT_EQ(declared.reading->status, 0u);
  EXPECT_EQ(declared.reading->multiturn_validity(), Validity::absent);
  EXPECT_EQ(declared.reading->singleturn_validity(), Validity::valid);
  EXPECT_FALSE(declared.numbers.contains("multiturn"));
  EXPECT_EQ(declared.numbers.at("alarms"), 0) << "live, in captures and in words they are left out alike";
  bench.encoder.raise_alarms(alarms::over_heat);
  const auto hot = bench.run("position");
  EXPECT_EQ(hot.reading->alarms, unsigned{alarms::over_heat});
  EXPECT_EQ(hot.reading->status, unsigned{status::alarm});
  EXPECT_EQ(bench.run("clear-alarms").error, Error::none);
  EXPECT_EQ(bench.everything().alarms, alarms::battery_alarm);
}

// The sequence of replies: 0 and 1 are positions, 2 to 11 answer the reset, 12 is the verification.
TEST(TformatProcedures, DetectsResetThatFailed) {
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
        Row{"clear-alarms",
            {.status = status::alarm, .encoder_id = 0x11, .alarms = alarms::over_heat},
            "over_heat remains"},
        Row{"clear-alarms", {.status = status::alarm, .encoder_id = 0x11, .alarms = alarms::battery_alarm}, ""}}) {
    Bench bench([&row](unsigned index, Wire& reply) {
      if (index == 12) reply = wire(row.verification);
    });
    const auto reset = bench.run(row.name);
    EXPECT_EQ(reset.error, row.detail.empty() ? Error::none : Error::cross_check_failed) << row.name << row.detail;
    EXPECT_TRUE(reset.says(row.detail)) << reset.detail;
    EXPECT_EQ(reset.reading.has_value(), row.detail.empty());
  }
}

// The zero and the verification are read 0.35 degrees apart at most: 127 of 2^17 counts.
TEST(TformatProcedures, ZeroThatMayHaveBeenIgnoredIsUnproven) {
  struct Row {
    std::int64_t before;
    std::uint32_t now;
    Error error;
    ChangeSent change;
  };
  for (const Row& row :
       {Row{120, 120, Error::none, ChangeSent::unproven}, Row{127, 0, Error::none, ChangeSent::unproven},
        Row{128, 0, Error::none, ChangeSent::yes}, Row{128, 127, Error::none, ChangeSent::yes},
        Row{4000, 4000, Error::cross_check_failed, ChangeSent::refused},
        Row{4000, 4007, Error::cross_check_failed, ChangeSent::refused},
        Row{4000, 4008, Error::cross_check_failed, ChangeSent::yes},
        Row{4000, 200, Error::cross_check_failed, ChangeSent::yes}}) {
    Bench bench([&row](unsigned index, Wire& reply) {
      const auto place = static_cast<std::uint32_t>(index == 12 ? row.now : row.before);
      if (index < 2 || index == 12) reply = wire(Reply{.singleturn = place, .encoder_id = 0x11});
    });
    const auto zero = bench.run("zero");
    EXPECT_EQ(zero.error, row.error) << row.before << " " << row.now;
    EXPECT_EQ(zero.change, row.change) << row.before << " " << row.now;
    EXPECT_EQ(zero.note.empty(), row.change != ChangeSent::unproven) << zero.note;
  }
}

TEST(TformatProcedures, NotesWhatAResetChangedBesides) {
  struct Row {
    std::string_view name;
    Reply verification;
    std::string_view note;
  };
  for (const Row& row :
       {Row{"zero", {.multiturn = 777, .encoder_id = 0x11}, "the turns changed too"},
        Row{"zero", {.multiturn = 13, .encoder_id = 0x11}, ""},
        Row{"reset-multiturn", {.singleturn = 20000, .encoder_id = 0x11}, "the position within the turn"},
        Row{"reset-multiturn", {.singleturn = 4003, .encoder_id = 0x11}, ""},
        Row{"clear-alarms", {.singleturn = 500, .multiturn = 12, .encoder_id = 0x11}, "the position"},
        Row{"clear-alarms", {.singleturn = 4000, .multiturn = 777, .encoder_id = 0x11}, "the turns"},
        Row{"clear-alarms", {.singleturn = 4000, .multiturn = 12, .encoder_id = 0x11}, ""}}) {
    Bench bench([&row](unsigned index, Wire& reply) {
      if (index == 12) reply = wire(row.verification);
    });
    bench.shaft.put(12, 4000);
    const auto reset = bench.run(row.name);
    EXPECT_EQ(reset.error, Error::none) << reset.detail;
    EXPECT_EQ(reset.change, ChangeSent::yes) << row.name;
    EXPECT_EQ(reset.note.empty(), row.note.empty()) << row.name << ": " << reset.note;
    EXPECT_EQ(reset.note.find(row.note), 0U) << row.name << ": " << reset.note;
  }
}

TEST(TformatProcedures, LostReplyStopsAResetUnlessItIsTheTenth) {
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
       {Row{7, 8, Error::wrong_length, "one of the requests in a row", 5},
        Row{10, 11, Error::wrong_length, "one of the requests in a row", 5}, Row{11, 12, Error::none, "", 0},
        Row{12, 15, Error::wrong_length, "whether the encoder obeyed could not be read", 0}}) {
    Bench bench(lose(row.from, row.to));
    bench.shaft.put(5, 0);
    const auto reset = bench.run("reset-multiturn");
    EXPECT_EQ(reset.error, row.error) << row.from;
    EXPECT_TRUE(reset.says(row.detail)) << reset.detail;
    EXPECT_EQ(bench.encoder.everything(bench.line.now()).multiturn, row.turns) << row.from;
    EXPECT_EQ(bench.violations(), 0u);
  }
}

}  // namespace
}  // namespace absenc::tformat
