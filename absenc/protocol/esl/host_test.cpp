// SPDX-License-Identifier: Apache-2.0
// The unit's commands against the virtual QS35 in virtual time.
#include "absenc/protocol/esl/host.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <tuple>

#include "absenc/protocol/esl/bench_test.hpp"

namespace absenc::esl {
namespace {

using testing::Bench;
using testing::Told;
using testing::Wire;
using testing::wire;

TEST(EslHost, ReadsTheSafetyPositionInTheTimeOfTheWire) {
  Bench bench;
  bench.shaft.put(4660, 0xABCDEF);
  const Told read = bench.run("position");
  ASSERT_EQ(read.error, Error::none);
  EXPECT_EQ(bench.line.now(), request_pause + 2us + answer_time + 18us);
  ASSERT_TRUE(read.reading.has_value());
  EXPECT_EQ(read.reading->singleturn, 0xABCDEFu);
  EXPECT_EQ(read.reading->multiturn, 4660u);
  EXPECT_TRUE(read.reading->singleturn_valid() && read.reading->multiturn_valid && read.reading->ready);
  EXPECT_EQ(read.reading->latched, request_pause + 1us + 4300ns);  // the end bit of CF is over after one character
  EXPECT_EQ(read.reading->received, request_pause + 22us);
  EXPECT_EQ(read.numbers.at("redundant_singleturn"), 0xABCDEF >> 15);
}

TEST(EslHost, Id8IsNeverSentEightTimesInARow) {
  Bench bench;
  for (unsigned i = 0; i < 20; ++i) EXPECT_EQ(bench.run("encoder-id").error, Error::none);
  EXPECT_EQ(bench.violations(), 0u);
  for (unsigned i = 0; i < 8; ++i) bench.raw(Request{DataId::encoder_id});
  ASSERT_EQ(bench.violations(), 1u);  // the rule is watched
}

// "If there is no Start Bit after the End Bit of the last frame": one bit between two frame sets is the least.
TEST(EslHost, EachRequestBeginsTwoBitsAfterTheReplyBeforeInEveryConversation) {
  const std::vector<std::pair<const char*, std::vector<std::int64_t>>> commands{{"position", {}},
                                                                                {"position", {}},
                                                                                {"safe-position", {}},
                                                                                {"encoder-id", {}},
                                                                                {"alarms", {}},
                                                                                {"led-or-lissajous", {}},
                                                                                {"scan", {}},
                                                                                {"zero", {}},
                                                                                {"clear-alarms", {}},
                                                                                {"memory-read", {3, 0}},
                                                                                {"memory-write", {3, 7, 0}},
                                                                                {"select-page", {8}},
                                                                                {"reset-multiturn", {}}};
  Bench bench;
  std::size_t last_sender = 1;
  Time last_end = -1ms;
  Time shortest = never;
  bench.line.observe([&](std::size_t sender, Time start, Time end, std::uint8_t) {
    if (sender == 1 && last_sender != 1) shortest = std::min(shortest, start - last_end);
    last_sender = sender;
    last_end = end;
  });
  for (const auto& [command, arguments] : commands) {
    shortest = never;
    EXPECT_EQ(bench.run(command, arguments).error, Error::none) << command;
    EXPECT_GE(shortest, line_settings.bits(2)) << command;
  }
  EXPECT_EQ(bench.violations(), 0u);
}

// ---- Which encoder it is

TEST(EslHost, AnEncoderIdThatIsNotThatOfTheOptionsIsReported) {
  for (const auto& [id, turns, words] :
       {std::tuple{0x98, true, "says 24 bits and no turns, the options say 24 bits and turns"},
        std::tuple{0xD4, true, "says 20 bits and turns, the options say 24 bits and turns"},
        std::tuple{0x58, true, "says 24 bits and turns, not a safety encoder"},
        std::tuple{0xD8, false, "says 24 bits and turns, the options say 24 bits and no turns"}}) {
    Bench bench({.turns = turns}, [id = static_cast<std::uint8_t>(id)](unsigned, Wire& reply) {
      Result<Reply> sent = decode_reply({}, {DataId::encoder_id}, reply);
      if (!sent) return;
      sent->one.encoder_id = sent->two.encoder_id = id;
      reply = wire(*sent);
    });
    const Told told = bench.run("encoder-id");
    EXPECT_EQ(text_of(told.error).name, "unexpected_reply");
    EXPECT_TRUE(told.says(words)) << told.detail;
    EXPECT_NE(told.advice.find("model"), std::string::npos) << told.advice;
  }
}

TEST(EslHost, AnEncoderOfOneTurnHasNone) {
  Bench bench({.turns = false});
  bench.shaft.put(7, 0xABCDEF);
  for (const char* command : {"position", "position-short", "safe-position"}) {
    const Told read = bench.run(command);
    ASSERT_EQ(read.error, Error::none) << command;
    EXPECT_EQ(read.reading->singleturn, 0xABCDEFu) << command;
    EXPECT_EQ(read.reading->multiturn_validity(), Validity::absent) << command;
    EXPECT_EQ(read.numbers.count("multiturn"), 0u) << command;
  }
  EXPECT_EQ(bench.run("encoder-id").numbers.at("encoder_id"), 0x98);
  EXPECT_EQ(bench.run("zero").error, Error::none);
  EXPECT_EQ(bench.read().singleturn, 0u);
  const std::uint64_t answered = bench.encoder.answer_count();
  const Told reset = bench.run("reset-multiturn");
  EXPECT_EQ(reset.error, Error::unsupported);
  EXPECT_TRUE(reset.says("one turn")) << reset.detail;
  EXPECT_EQ(bench.encoder.answer_count(), answered);
}

TEST(EslHost, TurnsFromAnEncoderOfOneTurnAreAnError) {
  Bench bench;
  bench.shaft.put(7, 0);
  bench.options = testing::options_of({.turns = false});
  const Told read = bench.run("position-short");
  EXPECT_EQ(read.error, Error::out_of_range);
  EXPECT_TRUE(read.says("turns=false")) << read.detail;
}

// ---- Safe positions

// One exchange each, as soon as two have shown that the counter moves.
TEST(EslHost, SafePositionsFollowEachOther) {
  Bench bench;
  const testing::Talk made(unit, testing::options_of({}), "safe-position");
  unsigned safe = 0;
  bench.line.on_emit = [&] {
    EXPECT_EQ((*made).error(), Error::none);
    EXPECT_EQ((*made).reading()->singleturn, safe);
    EXPECT_EQ(bench.encoder.answer_count(), safe + 2);
    bench.shaft.put(0, ++safe);
    return safe < 300;
  };
  bench.line.converse(*made);
  EXPECT_EQ(safe, 300u);
}

TEST(EslHost, ACounterThatStopsBetweenSafePositionsIsFound) {
  Bench bench;
  const testing::Talk made(unit, testing::options_of({}), "safe-position");
  unsigned safe = 0;
  bench.line.on_emit = [&] {
    if (++safe == 10) {
      bench.condition(condition::ch1_sequence, 11);  // that of the last reply
      bench.condition(condition::ch2_sequence, 11);
    }
    return safe < 20;
  };
  EXPECT_TRUE(bench.line.converse(*made));
  EXPECT_EQ(safe, 10u);
  EXPECT_EQ((*made).error(), Error::sequence_mismatch);
  EXPECT_NE((*made).detail().find("stands still"), std::string_view::npos) << (*made).detail();
  EXPECT_EQ((*made).reading(), nullptr);
}

// Every profile on both sides; another address too.
TEST(EslHost, EveryProfileIsSpokenOnBothSides) {
  for (std::size_t option = 0; option < open_options; ++option) {
    for (std::size_t value = 0; value < options.infos[option].choices.size(); ++value) {
      SCOPED_TRACE(std::string(options.infos[option].name) + "=" + std::string(options.infos[option].choices[value]));
      Profile profile{.address = 5};
      options.put(profile, option, static_cast<std::int64_t>(value));
      Bench bench(profile);
      bench.shaft.put(-1, 0xABCDEF);
      const Told safe = bench.run("safe-position");
      ASSERT_EQ(safe.error, Error::none) << safe.detail;
      EXPECT_EQ(safe.numbers.at("safe_singleturn"), 0xABCDEF);
      EXPECT_EQ(safe.numbers.at("encoder_address"), 5);
      EXPECT_EQ(bench.run("position").reading->multiturn, 0xFFFFu);
      EXPECT_EQ(bench.run("calibration").reading->singleturn, 0xABCDEFu);
      EXPECT_EQ(bench.run("led-or-lissajous").error, Error::none);
      EXPECT_EQ(bench.run("zero").error, Error::none);
      EXPECT_EQ(bench.violations(), 0u);
    }
  }
}

TEST(EslHost, SilenceIsATimeout) {
  Bench bench;
  bench.encoder.power_off(Time{});
  const Told read = bench.run("position");
  EXPECT_EQ(read.error, Error::timeout);
  EXPECT_EQ(bench.line.now(), request_pause + 2us + answer_limit);
  EXPECT_EQ(read.detail, "it is also silent when request_crc, crc_bit_order or address is another");
  EXPECT_EQ(read.sent.size(), 2u);
  EXPECT_TRUE(bench.run("memory-read", {0}).says("(Figure 18)"));
}

// Each with its own name and sentence.
TEST(EslHost, WhatIsWrongWithAReplyIsSaid) {
  struct Row {
    const char* sentence;
    Error error;
    testing::Tamper tamper;
  };
  const std::vector<Row> rows{
      {"CRC of channel 1 is wrong", Error::bad_checksum, [](unsigned, Wire& reply) { reply[4] ^= 1; }},
      {"CRC of channel 2 is wrong", Error::bad_checksum, [](unsigned, Wire& reply) { reply[13] ^= 1; }},
      {"channels are swapped", Error::bad_checksum,
       [](unsigned, Wire& reply) { std::rotate(reply.begin(), reply.begin() + 11, reply.end()); }},
      {"channel 2 is missing", Error::wrong_length, [](unsigned, Wire& reply) { reply.resize(11); }},
      {"number of bytes", Error::wrong_length, [](unsigned, Wire& reply) { reply.pop_back(); }},
      {"CRC of a channel is wrong", Error::bad_checksum, [](unsigned, Wire& reply) { reply[4] ^= 1, reply[13] ^= 1; }},
      {"address of another encoder", Error::unexpected_reply,
       [&](unsigned, Wire& reply) { reply = wire({.encoder_address = 1, .one = {.status = status::ready}}); }},
      {"wrong parity bit in the request", Error::request_rejected,
       [](unsigned, Wire& reply) { reply = wire({.one = {.status = status::parity_error}}); }},
  };
  for (const Row& row : rows) {
    Bench bench({}, row.tamper);
    const Told read = bench.run("position");
    EXPECT_EQ(text_of(read.error).name, text_of(row.error).name) << row.sentence;
    EXPECT_TRUE(read.says(row.sentence)) << read.detail;
    EXPECT_FALSE(read.reading.has_value());
    EXPECT_GE(bench.line.now(), read.received_at + gap_limit) << row.sentence;
    EXPECT_EQ(bench.violations(), 0u);
  }
}

// Of characters that were damaged nobody knows what they would have been.
TEST(EslHost, OfADamagedReplyNoSentenceIsMade) {
  using Happening = Event<std::uint8_t>;
  const testing::Talk made(unit, testing::options_of({}), "position");
  Conversation<std::uint8_t>& host = *made;
  static_cast<void>(host.next({}));
  host.feed({.kind = Happening::Kind::sent, .at = 2us});
  const Wire channel_1 = wire({.one = {.status = status::ready}});
  host.feed({.kind = Happening::Kind::received, .at = 15us, .items = Bytes(channel_1).first(11)});
  host.feed({.kind = Happening::Kind::line_error, .at = 16us});
  host.feed({.kind = Happening::Kind::silence, .at = 20us});
  EXPECT_EQ(host.error(), Error::wrong_length);
  EXPECT_EQ(host.detail(), "");
}

TEST(EslHost, AProfileThatDoesNotFitIsNamed) {
  const Profile plain;
  struct Row {
    Profile host;     // what the host believes
    Profile encoder;  // what the encoder is
    const char* command;
    const char* sentence;
  };
  for (const Row& row : {
           Row{plain, {.status_order = FieldOrder::tformat}, "position", "status_order=tformat"},
           Row{{.status_order = FieldOrder::tformat}, plain, "position", "status_order=document"},
           Row{plain, {.rs1_sc2 = RedundantBit::b0}, "position", "rs1_sc2=b0"},
           Row{plain, {.crc16_byte_order = CrcByteOrder::high}, "position", "crc16_byte_order=high"},
           Row{plain, {.crc16_byte_order = CrcByteOrder::table12}, "position", "crc16_byte_order=table12"},
           Row{plain,
               {.crc16_byte_order = CrcByteOrder::high, .status_order = FieldOrder::tformat},
               "position",
               "crc16_byte_order=high status_order=tformat"},
           Row{{.address = 1}, {.parity_scope = ParityScope::all, .address = 1}, "position", "parity_scope=all"},
           Row{{.id6_rs = Id6Redundant::bits_9}, plain, "calibration", "id6_rs=16"},
       }) {
    Bench bench(row.encoder);
    bench.shaft.put(0, 0xABCDEF);
    bench.options = testing::options_of(row.host);
    const Told read = bench.run(row.command);
    EXPECT_NE(read.error, Error::none) << row.sentence;
    EXPECT_TRUE(read.says(row.sentence)) << row.sentence << ": " << read.detail;
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
  };
  for (const char* command : {"position", "zero", "scan"}) {
    Shouting shouting;
    Bench bench;
    bench.line.attach(sim::Role::device, shouting);
    const Told read = bench.run(command);
    EXPECT_EQ(read.error, Error::wrong_length);
    EXPECT_TRUE(read.finished);
    EXPECT_TRUE(read.says("without a pause")) << read.detail;
    EXPECT_LE(bench.line.now(), 2 * noise_limit);
  }
}

// ---- Resets

TEST(EslHost, Resets) {
  Bench bench;
  bench.shaft.put(12, 4'000'000);
  bench.encoder.raise_alarms(alarms::xc_error);
  Told after = bench.run("clear-alarms");
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
  // The zero survives power off, in both channels.
  bench.restart();
  EXPECT_EQ(bench.read().singleturn, 0u);
  EXPECT_EQ(bench.read().redundant, 0u);
  EXPECT_EQ(bench.read().multiturn, 0u);
}

// Between the looks 10 ms, between the eight requests 40 us from start to start, then the time of the EEPROM.
TEST(EslHost, TheTimesOfAReset) {
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
    for (std::size_t i = 1; i < 8; ++i) EXPECT_EQ(starts[i] - starts[i - 1], 40us);
    ASSERT_EQ(looks.size(), 3u);
    const Time reply = 18us + answer_time + 2us;
    EXPECT_EQ(looks[1] - looks[0], reply + 10ms);
    EXPECT_EQ(looks[2] - starts[7], 2us + answer_time + reply_length(id) * 1us + last);
  }
}

TEST(EslHost, WhatCannotBeClearedIsNamed) {
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
    const Told clear = bench.run("clear-alarms");
    EXPECT_EQ(clear.error, Error::cross_check_failed);
    EXPECT_EQ(clear.detail, sentence);
  }
  Bench bench;
  bench.condition(condition::ch2_alarms, alarms::memory_error);
  EXPECT_EQ(bench.run("clear-alarms").detail, "memory_error remains; switch the encoder off and on");
}

TEST(EslHost, AMultiturnErrorNeedsDThenC) {
  Bench bench;
  bench.shaft.put(7, 100);
  bench.encoder.raise_alarms(alarms::multiturn_error);
  const Told turns = bench.run("reset-multiturn");
  EXPECT_EQ(turns.error, Error::none);
  EXPECT_EQ(turns.numbers.at("ch1_alarms"), alarms::multiturn_error);
  const Told clear = bench.run("clear-alarms");
  EXPECT_EQ(clear.error, Error::none);
  EXPECT_EQ(clear.numbers.at("ch1_alarms"), 0);
}

TEST(EslHost, AnIdDThatMovesTheSingleTurnZeroIsFound) {
  Bench bench;
  bench.shaft.put(7, 1'000'000);
  bench.condition(condition::id_d_clears_singleturn, 1);
  const Told turns = bench.run("reset-multiturn");
  EXPECT_EQ(turns.error, Error::cross_check_failed);
  EXPECT_TRUE(turns.says("single-turn zero too"));
}

TEST(EslHost, AResetOnATurningShaftOrAStartingEncoderIsNotSent) {
  for (const std::int32_t rpm : {5, -5}) {
    Bench bench;
    bench.shaft.spin(rpm, Time{});
    const Told zero = bench.run("zero");
    EXPECT_EQ(zero.error, Error::invalid_argument);
    EXPECT_TRUE(zero.says("nothing was changed"));
    EXPECT_EQ(bench.encoder.answer_count(), 2u);  // it only looked
  }
  Bench starting;
  starting.restart(testing::PowerOn::real);
  const Told zero = starting.run("zero");
  EXPECT_EQ(zero.error, Error::invalid_argument);
  EXPECT_TRUE(zero.says("not ready"));
}

// The zero would be wrong for ever: it is in the EEPROM.
TEST(EslHost, AZeroOfAPositionThatDoesNotHoldIsNotSent) {
  Bench bench;
  bench.shaft.put(7, 1'000'000);
  bench.encoder.raise_alarms(alarms::singleturn_error);
  const Told zero = bench.run("zero");
  EXPECT_EQ(zero.error, Error::invalid_argument);
  EXPECT_TRUE(zero.says("does not hold")) << zero.detail;
  EXPECT_EQ(bench.encoder.answer_count(), 2u);
  EXPECT_EQ(bench.encoder.memory_version(), 0u);
}

// Replies 0 and 1 are looks, 2 to 9 answer the requests, 10 and, when they fail, 11 and 12 are the verification.
TEST(EslHost, ALostReplyStopsAResetUnlessItIsTheLast) {
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
    const Told reset = bench.run("reset-multiturn");
    EXPECT_EQ(reset.error, row.error) << row.first;
    EXPECT_TRUE(reset.says(row.words)) << reset.detail;
    EXPECT_EQ(bench.encoder.answer_count(), row.sent) << row.first;
    EXPECT_EQ(bench.encoder.reply_to(DataId::position, bench.line.now()).multiturn, row.turns) << row.first;
  }
}

TEST(EslHost, AResetThatDidNotHappenIsFound) {
  for (const auto& [command, counts, turns, words] :
       {std::tuple{"zero", 933 + 1, 0, "not zero"}, std::tuple{"reset-multiturn", 0, 1, "turns are still not zero"}}) {
    Bench bench({}, [counts = counts, turns = turns](unsigned index, Wire& reply) {
      if (index != 10) return;
      reply = wire({.one = {.status = status::ready},
                    .two = {.status = status::ready | status::channel_2},
                    .singleturn = static_cast<std::uint32_t>(counts),
                    .multiturn = static_cast<std::uint16_t>(turns)});
    });
    const Told reset = bench.run(command);
    EXPECT_EQ(reset.error, Error::cross_check_failed);
    EXPECT_TRUE(reset.says(words)) << reset.detail;
    EXPECT_FALSE(reset.reading.has_value());
  }
}

// ---- Several encoders on one line

struct Line8 {
  explicit Line8(const std::vector<std::uint8_t>& addresses) {
    for (const std::uint8_t address : addresses) {
      const auto place = static_cast<std::int64_t>(shafts.size());
      shafts.push_back(std::make_unique<testing::TestShaft>());
      shafts.back()->put(place, place * 1'000'000 + 77);
      encoders.push_back(
          std::make_unique<VirtualEncoder>(Profile{.address = address, .bus = sharing_yes}, *shafts.back()));
      encoders.back()->power_on(Time{}, testing::PowerOn::skip);
      line.attach(sim::Role::device, *encoders.back());
    }
  }
  std::vector<std::unique_ptr<testing::TestShaft>> shafts;
  std::vector<std::unique_ptr<VirtualEncoder>> encoders;
  testing::HostedLine line{LinkKind::half_duplex, line_settings};
};

TEST(EslBus, EachAnswersItsOwnRequestsAtOnceBehindThoseOfOthers) {
  Line8 bus({0, 1, 2, 3, 4, 5, 6, 7});
  bus.encoders[3]->power_off(Time{});
  for (unsigned round = 0; round < 100; ++round) {
    for (std::uint8_t address = 0; address < most_encoders; ++address) {
      const testing::Talk read(unit, testing::options_of({.address = address}), "position");
      ASSERT_TRUE(bus.line.converse(*read));
      ASSERT_EQ(read->error(), address == 3 ? Error::timeout : Error::none) << round << " " << int{address};
      if (address == 3) continue;
      EXPECT_EQ(read->reading()->singleturn, address * 1'000'000u + 77);
    }
  }
  for (const auto& encoder : bus.encoders) EXPECT_EQ(encoder->violation_count(), 0u);
}

TEST(EslBus, AScanFindsWhoAnswersAndWhatIsDamaged) {
  struct Scan final : FieldSink {
    void put(const FieldValue& value) override {
      if (value.info->name == "encoder_address") nodes.push_back(static_cast<int>(value.number));
      if (value.info->name == "clash" && value.number != 0) clashes.push_back(nodes.back());
    }
    std::vector<int> nodes;
    std::vector<int> clashes;
  };
  for (const auto& [there, nodes, clashes] : {std::tuple{Wire{1, 4, 6}, std::vector{1, 4, 6}, std::vector<int>{}},
                                              std::tuple{Wire{1, 4, 4}, std::vector{1, 4}, std::vector{4}},
                                              std::tuple{Wire{}, std::vector<int>{}, std::vector<int>{}}}) {
    Line8 bus(there);
    const testing::Talk made(unit, testing::options_of({}), "scan");
    Conversation<std::uint8_t>& host = *made;
    EXPECT_TRUE(bus.line.converse(host));
    EXPECT_EQ(host.error(), nodes.empty() ? Error::timeout : Error::none);
    Scan found;
    host.report(found);
    EXPECT_EQ(found.nodes, nodes);
    EXPECT_EQ(found.clashes, clashes);
    for (const auto& encoder : bus.encoders) {
      if (clashes.empty()) {
        EXPECT_EQ(encoder->violation_count(), 0u);
      }
      EXPECT_EQ(encoder->answer_count(),
                clashes.empty() || encoder == bus.encoders[0] ? 1u : 3u);  // ID 5 and never ID 8
    }
  }
}

// "disconnect one" is bad advice where there is only one: its answer is whole.
TEST(EslBus, ARefusalIsNoClash) {
  struct Scan final : FieldSink {
    void put(const FieldValue& value) override {
      if (value.info->role == Role::clash) clash = value.number != 0;
      if (value.info->role == Role::trouble) trouble.assign(value.bytes.begin(), value.bytes.end());
    }
    bool clash = true;
    std::string trouble;
  };
  struct Row {
    Profile encoder;
    std::size_t condition;
    std::int64_t value;
    const char* words;
  };
  for (const Row& row : {Row{{}, condition::ch1_status_set, status::parity_error, "wrong parity bit"},
                         Row{{}, condition::ch1_status_set, status::stop_error, "wrong stop bit"},
                         Row{{}, condition::ch1_status_set, status::channel_2, "says that it is channel 2"},
                         Row{{.status_order = FieldOrder::tformat}, condition::temperature, 35, "channel 2"}}) {
    Bench bench(row.encoder);
    bench.options = testing::options_of({});
    bench.condition(row.condition, row.value);
    if (row.encoder.status_order == FieldOrder::tformat) bench.encoder.raise_alarms(alarms::overspeed);
    const testing::Talk made(unit, bench.options, "scan");
    Conversation<std::uint8_t>& host = *made;
    EXPECT_TRUE(bench.line.converse(host));
    EXPECT_EQ(host.error(), Error::none);
    Scan found;
    host.report(found);
    EXPECT_FALSE(found.clash) << row.words;
    EXPECT_NE(found.trouble.find(row.words), std::string::npos) << found.trouble;
  }
}

}  // namespace
}  // namespace absenc::esl
