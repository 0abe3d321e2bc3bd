// SPDX-License-Identifier: Apache-2.0
// Uses the library as a program does, with virtual encoders.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "absenc/client/emulate.hpp"
#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/find_crc.hpp"
#include "absenc/client/sample_rows.hpp"
#include "absenc/client/test_support.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

using testing::HasSubstr;
using testing::IsEmpty;
using Kind = Sample::Kind;

// ---- Search for the checksum of an unknown encoder

TEST(ClientFindCrc, TellsThePolynomialAndWhichFrameIsOdd) {
  std::vector<CheckedFrame> frames;
  constexpr CrcParameters crc{.width = 8, .poly = 0x97, .init = 0x5A, .refin = false, .refout = false, .xorout = 0};
  for (std::uint8_t i = 0; i < 10; ++i) {
    const auto byte = [&](int factor) { return static_cast<std::uint8_t>(37 * i * i + factor * (i + 11)); };
    std::vector<std::uint8_t> frame{byte(3), byte(71), byte(113), byte(29)};
    if (i % 2 != 0) frame.push_back(byte(57));
    frame.push_back(static_cast<std::uint8_t>(crc_bitwise(crc, frame)));
    frames.push_back({frame});
  }
  const CheckFindings good = find_crc(frames);
  ASSERT_FALSE(good.checks.empty());
  EXPECT_EQ(good.checks[0].name, "crc");
  EXPECT_EQ(good.checks[0].parameters.poly, crc.poly);
  EXPECT_LT(good.checks[0].chance, 1e-3);
  frames[4].bytes[1] ^= 0x10;
  const CheckFindings odd = find_crc(frames);
  EXPECT_TRUE(odd.checks.empty());
  EXPECT_EQ(odd.odd, 5u);
  EXPECT_THAT(odd.advice, HasSubstr("frame 5"));
  const auto one = [&] { static_cast<void>(find_crc(std::span(frames).first(1))); };
  EXPECT_THAT(thrown_by<UsageError>(one), HasSubstr("give several"));
}

// ---- Encoders that are opened by name

TEST(ClientEncoder, EveryUnitIsReadByItsName) {
  for (const Unit* unit : all_units()) {
    if (find_command(*unit, Verb::read) == nullptr) continue;
    Encoder encoder = open("sim:" + std::string(unit->id));
    const Reading reading = encoder.read();
    EXPECT_TRUE(reading.ready) << unit->id;
    EXPECT_EQ(reading.singleturn, 0u) << unit->id;
    EXPECT_EQ(&encoder.unit(), unit);
    EXPECT_GE(encoder.counters().good, 1u) << unit->id;
  }
}

TEST(ClientEncoder, WhatCannotBeSaysSo) {
  EXPECT_THAT(thrown_by<UsageError>([] { static_cast<void>(open("tfromat:/dev/null")); }), HasSubstr("tformat"));
  EXPECT_THAT(thrown_by<UsageError>([] { static_cast<void>(open("sim:tformat?modle=1")); }), HasSubstr("model"));
  EXPECT_THAT(thrown_by<os::Failure>([] { static_cast<void>(open("tformat:/dev/absenc-none")); }),
              HasSubstr("/dev/absenc-none"));
  Encoder encoder = open("sim:tformat");
  EXPECT_THAT(thrown_by<UsageError>([&] { encoder.run("memory-raed"); }), HasSubstr("memory-read"));
  EXPECT_THAT(thrown_by<UsageError>([&] { encoder.run("memory-read"); }), HasSubstr("needs the argument"));
  EXPECT_THAT(thrown_by<UsageError>([&] { encoder.run("memory-read", {1, 2, 3, 4, 5}); }), HasSubstr("too much"));
  EXPECT_THAT(thrown_by<UsageError>([&] { encoder.run("memory-read", {100'000}); }), HasSubstr("must be a number"));
}

TEST(ClientEncoder, ACommandTellsTypedValues) {
  Encoder encoder = open("sim:tformat");
  encoder.run("memory-write", {5, 0x42});
  const Answer read = encoder.run("memory-read", {5});
  EXPECT_EQ(std::get<std::int64_t>(read["value"]), 0x42);
  EXPECT_EQ(read.row().get<std::int64_t>("value"), 0x42);
  EXPECT_EQ(to_text(read["value"]), "66");
  EXPECT_THAT(thrown_by<UsageError>([&] { static_cast<void>(read["vlaue"]); }), HasSubstr("value"));
}

TEST(ClientEncoder, AnAnswerOutlivesItsEncoder) {
  Answer answer;
  {
    Answer first = open("sim:ssi?word=a_long_name=value:4 position:13").run("position");
    answer = first;  // the copy must stay valid after the original, `first`, is destroyed
  }
  EXPECT_EQ(answer["a_long_name"], Value(std::uint64_t{0}));
  EXPECT_EQ(answer.columns[0].name, "a_long_name");
}

TEST(ClientEncoder, SettingsAreReadWrittenAndReadBack) {
  Encoder encoder = open("sim:tformat");
  Settings settings = encoder.settings();
  const std::int64_t degrees[] = {85};
  EXPECT_FALSE(settings.set("overheat-threshold", degrees).was_so);
  EXPECT_EQ(settings.get("overheat-threshold")["overheat_threshold_c"], Value(std::int64_t{85}));
  EXPECT_TRUE(settings.set("overheat-threshold", degrees).was_so);
  const std::int64_t never[] = {0};
  const SettingChange change = settings.set("overheat-threshold", never);
  EXPECT_EQ(change.now["overheat_enabled"], Value(false));
  EXPECT_EQ(change.note, "");
  const auto misspelt = [&] { static_cast<void>(settings.get("overheat-treshold")); };
  EXPECT_THAT(thrown_by<UsageError>(misspelt), HasSubstr("overheat-threshold"));
}

// After a change of its address the encoder is reached at the new address.
TEST(ClientEncoder, GoesOnWithTheAddressThatItWasSetTo) {
  Encoder encoder = open("sim:raa38-modbus");
  const std::int64_t address[] = {7};
  EXPECT_THAT(encoder.settings().set("address", address).note, HasSubstr("address=7"));
  EXPECT_TRUE(encoder.read().singleturn_valid());
}

TEST(ClientEncoder, GoesOnAtTheRateThatItWasSetTo) {
  for (const bool by_name : {true, false}) {
    Encoder encoder = open("sim:raa38-modbus");
    if (by_name) {
      encoder.run("set-baud", {57'600});
    } else {
      const std::int64_t baud[] = {57'600};
      EXPECT_THAT(encoder.settings().set("baud", baud).note, HasSubstr("baud=57600"));
    }
    EXPECT_EQ(connection_of(encoder).uri().line.rate, 57'600u);
    EXPECT_TRUE(encoder.read().singleturn_valid());
  }
}

// However a change of the rate was broken off, the encoder can be read if, and only if, it has the rate of its
// connection.
TEST(ClientEncoder, IsReadAtItsRateWhenAChangeOfItsRateWasBrokenOff) {
  unsigned whole = 0;
  unsigned there = 0;
  unsigned elsewhere = 0;
  for (unsigned end = 0; end == 0 || end < whole; end += 1 + whole / 12) {
    Encoder encoder = open("sim:raa38-modbus");
    unsigned waits = 0;
    encoder.end_when([&] { return ++waits == end; });
    try {
      encoder.run("set-baud", {57'600});
      whole = waits;
    } catch (const Cancelled&) {
    }
    bool is_read = true;
    try {
      static_cast<void>(encoder.read());
    } catch (const EncoderFailure&) {
      is_read = false;
    }
    const bool is_there = encoder.run("baud")["baud"] == Value(std::int64_t{connection_of(encoder).uri().line.rate});
    EXPECT_EQ(is_read, is_there) << end << " of " << whole;
    EXPECT_FALSE(is_there && elsewhere != 0) << end << ": it had the new rate already";
    (is_there ? there : elsewhere) += 1;
  }
  EXPECT_GT(there, 1u);
  EXPECT_GT(elsewhere, 1u);
}

// Checks that `Cancelled` can be caught as std::exception, as `main` of the examples does.
TEST(ClientEncoder, CancelIsAStandardExceptionAndTheEncoderCanBeUsedAgain) {
  Encoder encoder = open("sim:tformat?singleturn=7");
  encoder.cancel();
  EXPECT_THAT(thrown_by<std::exception>([&] { static_cast<void>(encoder.read()); }), HasSubstr("cancelled"));
  EXPECT_THAT(thrown_by<std::exception>([] { throw os::Interrupted{}; }), HasSubstr("interrupted"));
  encoder.resume();
  EXPECT_EQ(encoder.read().singleturn, 7u);
}

TEST(ClientEncoder, DisconnectedEncoderOpensItsPortForTheNextReading) {
  Encoder encoder = open("sim:tformat?singleturn=7&multiturn=3");
  EXPECT_EQ(encoder.address(), "sim:tformat");
  EXPECT_TRUE(encoder.connected());
  EXPECT_EQ(encoder.read().singleturn, 7u);
  const std::uint64_t good = encoder.counters().good;
  encoder.disconnect();
  EXPECT_TRUE(encoder.notes().empty());
  EXPECT_FALSE(encoder.connected());
  EXPECT_EQ(encoder.counters().good, good);
  EXPECT_EQ(encoder.read().singleturn, 7u);
  EXPECT_TRUE(encoder.connected());
  encoder.disconnect();
  const Sample sample = encoder.next();
  EXPECT_EQ(sample.kind, Sample::Kind::back);
  EXPECT_EQ(sample.message, "the port is open");  // a port that was closed by `disconnect` does not count as lost
  EXPECT_EQ(encoder.losses(), 0u);
}

TEST(ClientEncoder, EndsAtItsDeadline) {
  Encoder encoder = open("sim:tformat?singleturn=7&fault=drop=1");
  const Time begin = os::now();
  EXPECT_THROW(static_cast<void>(encoder.read(begin)), DeadlinePassed);
  encoder = open("sim:tformat?singleturn=7");
  EXPECT_EQ(encoder.read(os::now() + std::chrono::minutes(10)).singleturn, 7u);
  EXPECT_EQ(encoder.read().singleturn, 7u);
  unsigned samples = 0;  // number of samples that were taken; the second one would be due after 1000 s
  const Time end = os::now() + std::chrono::milliseconds(50);
  for (const Sample& sample : encoder.samples({.rate_hz = 1e-3, .deadline = end})) {
    EXPECT_EQ(sample.position_state(), PositionState::good);
    ++samples;
  }
  EXPECT_EQ(samples, 1u);
  EXPECT_GE(os::now(), end);
}

TEST(ClientSample, SaysInOneWayWhetherItsPositionCanBeUsed) {
  Sample sample{.kind = Sample::Kind::reading};
  sample.reading.singleturn_bits = sample.reading.singleturn_valid_bits = 17;
  EXPECT_EQ(sample.position_state(), PositionState::good);
  sample.reading.singleturn_valid_bits = 0;
  EXPECT_EQ(sample.position_state(), PositionState::invalid);
  sample.reading.singleturn_known = false;
  EXPECT_EQ(sample.position_state(), PositionState::unknown);
  sample.doubtful = true;
  EXPECT_EQ(sample.position_state(), PositionState::unconfirmed);
  sample.reading.ready = false;
  EXPECT_EQ(sample.position_state(), PositionState::starting);
  sample.kind = Sample::Kind::lost;
  EXPECT_EQ(sample.position_state(), PositionState::none);
  for (unsigned state = 0; state <= static_cast<unsigned>(PositionState::none); ++state) {
    for (unsigned other = 0; other < state; ++other) {
      EXPECT_NE(text_of(static_cast<PositionState>(state)), text_of(static_cast<PositionState>(other)));
    }
  }
}

TEST(ClientSamples, AreRowsOfNamedValues) {
  Encoder encoder = open("sim:esl?singleturn=1000&fault=corrupt=0.3");
  SampleRows rows(encoder.unit(), encoder.options(), Time{}, SampleRows::With::motion);
  std::size_t good = 0;
  std::size_t failed = 0;
  for (const Sample& sample : encoder.samples({.count = 200})) {
    const Row& row = rows.of(sample);
    ASSERT_EQ(row.values.size(), rows.columns().size());
    if (row.get<bool>("ok")) {
      ++good;
      EXPECT_EQ(row["event"], Value());
      const bool is_valid = row.get<bool>("singleturn_valid");
      EXPECT_EQ(row["singleturn"], Value(sample.reading.singleturn));
      EXPECT_EQ(std::holds_alternative<double>(row["angle_deg"]), is_valid);
      EXPECT_EQ(std::holds_alternative<Invalid>(row["angle_deg"]), !is_valid);
    } else {
      ++failed;
      EXPECT_EQ(row["angle_deg"], Value());
      EXPECT_EQ(row.get<std::string>("event"), event_name(sample));
      EXPECT_EQ(row.get<std::string>("message"), sample.trouble.message);
    }
  }
  EXPECT_GT(good, 0u);
  EXPECT_GT(failed, 0u);
  EXPECT_EQ(rows.of_gap(Time{}, 12).get<std::uint64_t>("missed"), 12u);
}

// Two wrong bits at the same place of two bytes pass the checksum of T-Format.
TEST(ClientEncoder, APositionThatNoShaftReachesIsReadAgain) {
  Encoder encoder = open("sim:tformat?singleturn=1000&fault=corrupt=0.6");
  const std::uint64_t& refused = encoder.counters().errors[static_cast<std::size_t>(Error::cross_check_failed)];
  const auto is_refusal = [](const BadExchangeText& bad) { return bad.error == Error::cross_check_failed; };
  std::uint64_t seen = 0;
  for (const Sample& sample : encoder.samples({.count = 3000})) {
    EXPECT_FALSE(sample.restarted) << sample.message;
    if (sample.position_valid) {
      EXPECT_LT(std::abs(sample.position - 1000), 1 << 17) << "a turn";
    }
    if (refused == seen) continue;
    seen = refused;
    EXPECT_TRUE(std::ranges::any_of(encoder.bad_exchanges(), is_refusal));
  }
  EXPECT_GT(refused, 0u);
}

TEST(ClientEncoder, AZeroThatWasMovedIsAJump) {
  // At 6 rpm nine turns take 90 s of simulated time, whatever the speed of this computer.
  Encoder encoder = open("sim:tformat?multiturn=9&max_rpm=6");
  EXPECT_EQ(encoder.next().position, 9 << 17);
  static_cast<void>(encoder.run("reset-multiturn"));
  const Sample sample = encoder.next();
  EXPECT_TRUE(sample.restarted);
  EXPECT_THAT(sample.message, HasSubstr("jumped"));
  EXPECT_EQ(sample.position, 0);
  EXPECT_EQ(encoder.counters().bad(), 0u);
  EXPECT_FALSE(encoder.next().restarted);
}

TEST(ClientEncoder, AFailureHasWhatWasSentAndWhatToTry) {
  Encoder encoder = open("sim:tformat?fault=silence=1");
  try {
    static_cast<void>(encoder.read());
    FAIL() << "no reply, and yet a reading";
  } catch (const EncoderFailure& failure) {
    EXPECT_EQ(failure.trouble.error, Error::timeout);
    EXPECT_EQ(failure.trouble.sent, "1A");
    EXPECT_THAT(failure.trouble.received, IsEmpty());
    EXPECT_NE(failure.trouble.advice, "");
  }
  EXPECT_EQ(encoder.bad_exchanges().at(0).error, Error::timeout);
}

TEST(ClientEncoder, SamplesEndWithTheirCountOrByCancel) {
  Encoder encoder = open("sim:tformat?motion=rpm=600");
  std::size_t count = 0;
  Time last{};
  for (const Sample& sample : encoder.samples({.rate_hz = 1000, .count = 20})) {
    ASSERT_EQ(sample.kind, Kind::reading) << sample.trouble.text();
    EXPECT_GT(sample.at, last);
    last = sample.at;
    ++count;
  }
  EXPECT_EQ(count, 20u);
  EXPECT_EQ(encoder.readings(), 20u);

  // Readings are due every 10 s; a thread that waits for the second one must be woken.
  std::atomic<unsigned> seen = 0;
  std::jthread other([&] {
    seen.wait(0);
    encoder.cancel();
  });
  for (const Sample& sample : encoder.samples({.rate_hz = 0.1})) {
    EXPECT_EQ(sample.kind, Kind::reading);
    ++seen;
    seen.notify_all();
  }
  EXPECT_EQ(seen, 1u);
  EXPECT_THROW(static_cast<void>(encoder.read()), Cancelled);
}

TEST(ClientEncoder, AnotherEndLeavesCancelAsItIs) {
  Encoder encoder = open("sim:tformat");
  bool over = false;
  encoder.end_when([&] { return over; });
  EXPECT_TRUE(encoder.read().ready);
  over = true;
  EXPECT_THROW(static_cast<void>(encoder.read()), Cancelled);
  over = false;
  encoder.cancel();
  EXPECT_THROW(static_cast<void>(encoder.read()), Cancelled);
}

// ---- Memory

MemoryImage some_bytes(std::uint32_t count) {
  MemoryImage image;
  for (std::uint32_t i = 0; i < count; ++i) image[{0, 10 + i}] = static_cast<std::uint8_t>(0x40 + i);
  return image;
}

TEST(ClientMemory, IsBroughtToWhatIsWantedAndReadBack) {
  Encoder encoder = open("sim:tformat");
  std::vector<std::size_t> steps;
  MemoryChange change(encoder.memory(), some_bytes(3), MemoryAccess::write);
  change.look();
  EXPECT_EQ(change.differing(), change.wanted());
  change.write([&](std::size_t done, std::size_t all) {
    steps.push_back(done);
    EXPECT_EQ(all, 3u);
  });
  change.verify();
  EXPECT_EQ(steps, (std::vector<std::size_t>{1, 2, 3}));
  EXPECT_EQ(change.written(), change.wanted());
  const MemoryImage whole = encoder.memory().read(dump_addresses(encoder.unit()));
  EXPECT_EQ(differing(some_bytes(3), whole), MemoryImage{});
  EXPECT_THROW(MemoryChange(encoder.memory(), {{{99, 0}, 0}}, MemoryAccess::write), UsageError);
  EXPECT_THROW(static_cast<void>(encoder.memory().read({{{99, 0}, 0}})), UsageError);
}

TEST(ClientMemory, WhateverBecomesOfItSaysWhatIsWritten) {
  Emulation emulation = emulate("tformat");
  Encoder encoder = open(emulation.address() + "?latency=300");
  MemoryChange change(encoder.memory(), some_bytes(6), MemoryAccess::write);
  change.look();
  EXPECT_THROW(change.write([&](std::size_t done, std::size_t) {
    if (done == 3) emulation.power_off();
  }),
               EncoderFailure);
  change.settle();
  EXPECT_EQ(change.written(), some_bytes(3));
  // the encoder was switched off after the third byte, so the request for the fourth byte was not sent
  EXPECT_EQ(change.unknown(), MemoryImage{});
  EXPECT_EQ(change.state(), ChangeState::not_sent);
  EXPECT_EQ(change.not_written().size(), 3u);
  emulation.power_on();
  change.write();
  change.verify();
  EXPECT_EQ(change.written(), some_bytes(6));
}

}  // namespace absenc::client
