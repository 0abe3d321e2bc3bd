// SPDX-License-Identifier: Apache-2.0
// Tests of the unit's commands with the virtual QS35 in virtual time.
#include "absenc/protocol/esl/host.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "absenc/protocol/esl/bench_test.hpp"

namespace absenc::esl {
namespace {

using testing::Bench;
using testing::RunResult;
using testing::Wire;
using testing::wire;

TEST(EslHost, ReadsTheSafetyPositionInTheTimeOfTheWire) {
  Bench bench;
  bench.shaft.put(4660, 0xABCDEF);
  const RunResult read = bench.run("position");
  ASSERT_EQ(read.error, Error::none);
  EXPECT_EQ(bench.line.now(), request_pause + 2us + answer_time + 18us);
  ASSERT_TRUE(read.reading.has_value());
  EXPECT_EQ(read.reading->singleturn, 0xABCDEFu);
  EXPECT_EQ(read.reading->multiturn, 4660u);
  EXPECT_TRUE(read.reading->singleturn_valid() && read.reading->multiturn_valid && read.reading->ready);
  // The encoder finishes the position 4.3 us after the request's control field, which is one character of 1 us.
  EXPECT_EQ(read.reading->latched, request_pause + 1us + 4300ns);
  EXPECT_EQ(read.reading->received, request_pause + 22us);
  EXPECT_EQ(read.numbers.at("redundant_singleturn"), 0xABCDEF >> 15);
}

TEST(EslHost, Id8IsNeverSentEightTimesInARow) {
  Bench bench;
  for (unsigned i = 0; i < 20; ++i) EXPECT_EQ(bench.run("encoder-id").error, Error::none);
  EXPECT_EQ(bench.violations(), 0u);
  for (unsigned i = 0; i < 8; ++i) bench.raw(Request{DataId::encoder_id});
  // the virtual encoder has reported that it received data ID 8 eight times in a row
  ASSERT_EQ(bench.violations(), 1u);
}

// The host pauses for at least the duration of two bits between a reply and its next request.
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

// ---- Encoder id

TEST(EslHost, ReportsEncoderIdThatDiffersFromOptions) {
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
    const RunResult told = bench.run("encoder-id");
    EXPECT_EQ(text_of(told.error).name, "unexpected_reply");
    EXPECT_TRUE(told.says(words)) << told.detail;
    EXPECT_NE(told.advice.find("model"), std::string::npos) << told.advice;
  }
}

TEST(EslHost, SingleTurnEncoderHasNoTurns) {
  Bench bench({.turns = false});
  bench.shaft.put(7, 0xABCDEF);
  for (const char* command : {"position", "position-short", "safe-position"}) {
    const RunResult read = bench.run(command);
    ASSERT_EQ(read.error, Error::none) << command;
    EXPECT_EQ(read.reading->singleturn, 0xABCDEFu) << command;
    EXPECT_EQ(read.reading->multiturn_validity(), Validity::absent) << command;
    EXPECT_EQ(read.numbers.count("multiturn"), 0u) << command;
  }
  EXPECT_EQ(bench.run("encoder-id").numbers.at("encoder_id"), 0x98);
  EXPECT_EQ(bench.run("zero").error, Error::none);
  EXPECT_EQ(bench.read().singleturn, 0u);
  const std::uint64_t answered = bench.encoder.answer_count();
  const RunResult reset = bench.run("reset-multiturn");
  EXPECT_EQ(reset.error, Error::unsupported);
  EXPECT_TRUE(reset.says("one turn")) << reset.detail;
  EXPECT_EQ(bench.encoder.answer_count(), answered);
}

TEST(EslHost, TurnsFromSingleTurnEncoderAreAnError) {
  Bench bench;
  bench.shaft.put(7, 0);
  bench.options = testing::options_of({.turns = false});
  const RunResult read = bench.run("position-short");
  EXPECT_EQ(read.error, Error::out_of_range);
  EXPECT_TRUE(read.says("turns=false")) << read.detail;
}

// ---- Safe positions

// The first safe position takes two exchanges; each later one takes one.
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

TEST(EslHost, DetectsStoppedSequenceCounter) {
  Bench bench;
  const testing::Talk made(unit, testing::options_of({}), "safe-position");
  unsigned safe = 0;
  bench.line.on_emit = [&] {
    if (++safe == 10) {
      // from here on both sequence counters stand still at 11, their value in the last reply
      bench.condition(condition::ch1_sequence, 11);
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

// Sets each value of each option that decides a property which the document leaves open; the encoder has address 5.
TEST(EslHost, HostAndEncoderAgreeInEveryProfile) {
  for (std::size_t option = 0; option < open_options; ++option) {
    for (std::size_t value = 0; value < options.infos[option].choices.size(); ++value) {
      SCOPED_TRACE(std::string(options.infos[option].name) + "=" + std::string(options.infos[option].choices[value]));
      Profile profile{.address = 5};
      options.put(profile, option, static_cast<std::int64_t>(value));
      Bench bench(profile);
      bench.shaft.put(-1, 0xABCDEF);
      const RunResult safe = bench.run("safe-position");
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
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.error, Error::timeout);
  EXPECT_EQ(bench.line.now(), request_pause + 2us + answer_limit);
  EXPECT_EQ(read.detail, "it is also silent when request_crc, crc_bit_order or address is another");
  EXPECT_EQ(read.sent.size(), 2u);
  EXPECT_TRUE(bench.run("memory-read", {0}).says("(Figure 18)"));
}

// Each row is a failed check with its error and with words of the sentence that explains it.
TEST(EslHost, ExplainsInvalidReplies) {
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
    const RunResult read = bench.run("position");
    EXPECT_EQ(text_of(read.error).name, text_of(row.error).name) << row.sentence;
    EXPECT_TRUE(read.says(row.sentence)) << read.detail;
    EXPECT_FALSE(read.reading.has_value());
    EXPECT_GE(bench.line.now(), read.received_at + gap_limit) << row.sentence;
    EXPECT_EQ(bench.violations(), 0u);
  }
}

// If characters of the reply were damaged, the host does not explain the error, because their content is unknown.
TEST(EslHost, DoesNotExplainDamagedReplies) {
  using LinkEvent = Event<std::uint8_t>;
  const testing::Talk made(unit, testing::options_of({}), "position");
  Conversation<std::uint8_t>& host = *made;
  static_cast<void>(host.next({}));
  host.feed({.kind = LinkEvent::Kind::sent, .at = 2us});
  const Wire channel_1 = wire({.one = {.status = status::ready}});
  host.feed({.kind = LinkEvent::Kind::received, .at = 15us, .items = Bytes(channel_1).first(11)});
  host.feed({.kind = LinkEvent::Kind::line_error, .at = 16us});
  host.feed({.kind = LinkEvent::Kind::silence, .at = 20us});
  EXPECT_EQ(host.error(), Error::wrong_length);
  EXPECT_EQ(host.detail(), "");
}

TEST(EslHost, NamesProfileThatFits) {
  const Profile plain;
  struct Row {
    Profile host;
    Profile encoder;
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
    const RunResult read = bench.run(row.command);
    EXPECT_NE(read.error, Error::none) << row.sentence;
    EXPECT_TRUE(read.says(row.sentence)) << row.sentence << ": " << read.detail;
  }
}

TEST(EslHost, EndsOnEndlessNoise) {
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
    bench.line.attach(sim::NodeRole::device, shouting);
    const RunResult read = bench.run(command);
    EXPECT_EQ(read.error, Error::wrong_length);
    EXPECT_TRUE(read.finished);
    EXPECT_TRUE(read.says("without a pause")) << read.detail;
    EXPECT_LE(bench.line.now(), 2 * noise_limit);
  }
}

}  // namespace
}  // namespace absenc::esl
