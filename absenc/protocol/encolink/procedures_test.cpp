// SPDX-License-Identifier: Apache-2.0
// Register conversations against the virtual AksIM-2 in virtual time, on both wires.
#include "absenc/protocol/encolink/procedures.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/author/command.hpp"
#include "absenc/protocol/encolink/bench_test.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using testing::Told;
using PowerOn = Device<std::uint8_t>::PowerOn;

class EncolinkRegister : public ::testing::TestWithParam<Wire> {
 protected:
  const Wire wire = GetParam();
};

INSTANTIATE_TEST_SUITE_P(Wires, EncolinkRegister, ::testing::Values(Wire::uart, Wire::spi),
                         [](const auto& test) { return test.param == Wire::uart ? "uart" : "spi"; });

TEST_P(EncolinkRegister, IsReadWhilePositionsGoOn) {
  Bench bench(testing::single, wire);
  bench.shaft.spin(600, bench.line.now());
  std::uint64_t last = 0;
  unsigned wrong = 0;
  const Told read = bench.run("memory-read", {0x4C}, [&](const Conversation<std::uint8_t>& emitted) {
    const Told now = testing::told_by(emitted);
    if (!now.reading || now.reading->singleturn <= last || now.numbers.at("singleturn") == 0) ++wrong;
    last = now.reading->singleturn;
  });
  ASSERT_EQ(read.error, Error::none) << read.detail;
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(bench.emits, bench.frames - 2 - 1);  // without the identity's, and the last one is the end
  EXPECT_EQ(read.texts.at("register"), "temperature_c");
  EXPECT_EQ(read.numbers.at("address"), 0x4C);
  EXPECT_DOUBLE_EQ(read.reals.at("temperature_c"), 35.0);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST_P(EncolinkRegister, SignedTenthsGoBelowZero) {
  Bench bench(testing::single, wire);
  bench.condition(condition_temperature, -12);
  EXPECT_DOUBLE_EQ(bench.run("memory-read", {0x4C}).reals.at("temperature_c"), -12.0);
  bench.shaft.spin(-60, bench.line.now());
  EXPECT_DOUBLE_EQ(bench.run("memory-read", {0x50}).reals.at("speed_rpm"), -60.0);
}

TEST_P(EncolinkRegister, EveryRegisterIsReadAsTheTableSays) {
  Bench bench(testing::multi, wire);
  for (const Register& one : registers) {
    const Told read = bench.run("memory-read", {one.address});
    if (one.access == Access::write_only) {
      EXPECT_EQ(read.error, Error::request_rejected) << one.name;
      continue;
    }
    ASSERT_EQ(read.error, Error::none) << one.name;
    EXPECT_EQ(read.numbers.at("length"), one.size);
    EXPECT_EQ(read.numbers.count(std::string(one.name)), 1u) << one.name;
  }
}

TEST_P(EncolinkRegister, WritesAreReadBack) {
  Bench bench(testing::multi, wire);
  const Told write = bench.run("memory-write", {0, 0x10000});
  ASSERT_EQ(write.error, Error::none) << write.detail;
  EXPECT_EQ(bench.encoder.offset(), 0x10000u);
  EXPECT_EQ(write.numbers.at("position_offset"), 0x10000);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x12345u + (1u << 16));
}

TEST_P(EncolinkRegister, EachRefusalHasItsSentence) {
  Bench bench(testing::multi, wire);
  const auto refusal = [&](std::int64_t address, std::int64_t size, std::int64_t value) {
    const Told write = bench.run("memory-write", {address, value, size});
    EXPECT_EQ(write.error, Error::request_rejected);
    return write.detail;
  };
  EXPECT_EQ(refusal(0x1234, 1, 0), text_of(AccessStatus::no_such_register));
  EXPECT_EQ(refusal(0x14, 4, 65536), text_of(AccessStatus::out_of_range));
  EXPECT_EQ(refusal(0x4C, 2, 0), text_of(AccessStatus::denied));
  EXPECT_EQ(refusal(0x00, 2, 0), text_of(AccessStatus::byte_count));
  ASSERT_EQ(bench.run("memory-write", {0x2E, 1}).error, Error::none);
  EXPECT_EQ(refusal(0x00, 4, 0), text_of(AccessStatus::locked));
  EXPECT_EQ(bench.run("save").detail, text_of(AccessStatus::locked));
  ASSERT_EQ(bench.run("memory-write", {0x2E, 0}).error, Error::none);
  EXPECT_EQ(bench.run("memory-write", {0, 0}).error, Error::none);
}

TEST_P(EncolinkRegister, WhatCannotBeAskedIsTheCallersFault) {
  Bench bench(testing::multi, wire);
  EXPECT_EQ(bench.run("memory-read", {0x1234}).error, Error::invalid_argument);
  EXPECT_EQ(bench.run("memory-write", {0x2E, 256}).error, Error::invalid_argument);
  EXPECT_EQ(bench.run("memory-write", {0x49, 0x63}).error, Error::invalid_argument);
  EXPECT_EQ(bench.encoder.answered(), 0u);
}

TEST_P(EncolinkRegister, BusyForEverEndsWhilePositionsGoOn) {
  Bench bench(testing::single, wire);
  bench.condition(condition_busy, 1);
  const Told read = bench.run("memory-read", {0x4C});
  EXPECT_EQ(read.error, Error::busy);
  EXPECT_NE(read.detail.find("busy for more than 2 s"), std::string::npos);
  EXPECT_GT(bench.emits, 20'000u);
  EXPECT_GT(bench.took, busy_limit);
  EXPECT_LT(bench.took, busy_limit + 10ms);
  EXPECT_EQ(bench.run("position").error, Error::none);
}

// The device does not hear the third byte of the keys: no answer to an access that it never saw.
TEST_P(EncolinkRegister, AnAccessThatIsIgnoredIsRepeated) {
  Bench bench(testing::single, wire);
  struct Deaf final : Machine<std::uint8_t> {
    explicit Deaf(VirtualEncoder& real) : encoder(real) {}
    void feed(const Event<std::uint8_t>& event) override {
      if (event.kind != Event<std::uint8_t>::Kind::received) return encoder.feed(event);
      std::vector<std::uint8_t> items(event.items.begin(), event.items.end());
      for (std::uint8_t& byte : items) {
        if (byte == 0xEF && damaged-- > 0) byte = 0xEE;
      }
      Event<std::uint8_t> changed = event;
      changed.items = items;
      encoder.feed(changed);
    }
    Step<std::uint8_t> next(Time now) override { return encoder.next(now); }
    VirtualEncoder& encoder;
    int damaged = 2;
  } deaf(bench.encoder);
  bench.line.replace(0, deaf);
  EXPECT_EQ(bench.run("memory-read", {0x4C}).error, Error::none);
  deaf.damaged = 1000;
  const Told read = bench.run("memory-read", {0x4C});
  EXPECT_EQ(read.error, Error::timeout);
  EXPECT_EQ(read.detail, "the encoder ignores register accesses: positions go on");
}

TEST_P(EncolinkRegister, AStatusOfADamagedRequestIsRepeated) {
  Bench bench(testing::single, wire);
  struct Noisy final : Machine<std::uint8_t> {
    explicit Noisy(VirtualEncoder& real) : encoder(real) {}
    void feed(const Event<std::uint8_t>& event) override {
      if (event.kind != Event<std::uint8_t>::Kind::received) return encoder.feed(event);
      std::vector<std::uint8_t> items(event.items.begin(), event.items.end());
      for (std::uint8_t& byte : items) {
        if (byte == 0x4C && damaged-- > 0) byte = 0x4D;
      }
      Event<std::uint8_t> changed = event;
      changed.items = items;
      encoder.feed(changed);
    }
    Step<std::uint8_t> next(Time now) override { return encoder.next(now); }
    VirtualEncoder& encoder;
    int damaged = 2;
  } noisy(bench.encoder);
  bench.line.replace(0, noisy);
  EXPECT_EQ(bench.run("memory-read", {0x4C}).error, Error::none);
  noisy.damaged = 1000;
  const Told read = bench.run("memory-read", {0x4C});
  EXPECT_EQ(read.error, Error::request_rejected);
  EXPECT_EQ(read.detail, text_of(AccessStatus::read_checksum));
}

TEST_P(EncolinkRegister, DamagedFramesBeginTheAccessAnew) {
  Bench bench(testing::single, wire);
  bench.device.set([](unsigned frame, std::vector<std::uint8_t>& reply) {
    if (frame == 9 || frame == 60 || frame == 130) reply[1] ^= 0x10;
  });
  const Told read = bench.run("memory-read", {0x4C});
  ASSERT_EQ(read.error, Error::none) << read.detail;
  EXPECT_DOUBLE_EQ(read.reals.at("temperature_c"), 35.0);
}

TEST_P(EncolinkRegister, UnpluggedInTheMiddleOfAWrite) {
  Bench bench(testing::single, wire);
  const Told write = bench.run("memory-write", {0, 0x10000000}, [&](const auto&) {
    if (bench.emits == 18) bench.encoder.power_off(bench.line.now());
  });
  EXPECT_EQ(write.error, wire == Wire::uart ? Error::timeout : Error::line_stuck);
  EXPECT_NE(write.detail.find("stopped answering in the middle of a register write"), std::string::npos);
  EXPECT_FALSE(write.reading);
}

// The answer to the write is lost, so it must be read back before it is written again.
TEST_P(EncolinkRegister, AWriteIsNotRepeatedBlindly) {
  Bench bench(testing::single, wire);
  bench.device.set([](unsigned frame, std::vector<std::uint8_t>& reply) {
    if (frame == 22) reply[1] ^= 0x10;
  });
  const Told write = bench.run("memory-write", {0, 0x10000});
  EXPECT_EQ(write.error, Error::none) << write.detail;
  EXPECT_EQ(bench.encoder.offset(), 0x10000u);
}

// After a refusal bytes of data may follow: the next access must not begin among them.
author::Procedure read_twice(Line& line, FoundRegister& found) {
  const Line::Answer refused = co_await line.attempt_read(0x1234, 20);
  if (refused.why.error != Error::request_rejected) co_return refused.why;
  co_await line.read(registers[temperature]);
  found.address = registers[temperature].address;
  co_return author::done;
}

struct Twice {
  using Format = encolink::Format;
  using Line = encolink::Line;
  static void put(FieldSink&, const Stream&) {}
};

TEST_P(EncolinkRegister, AnAccessAfterARefusal) {
  Bench bench(testing::multi, wire);
  std::array<std::byte, 2000> frames{};
  author::Told<Twice, author::Run<Twice, FoundRegister, read_twice>> twice(bench.format, {}, frames);
  bench.drive(twice);
  EXPECT_EQ(twice.error(), Error::none);
  EXPECT_EQ(load_big_endian(twice.data()), 350u);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST_P(EncolinkRegister, ACommandIsNeverRepeated) {
  Bench bench(testing::single, wire);
  bench.device.set([](unsigned frame, std::vector<std::uint8_t>& reply) {
    if (frame == 100) reply[1] ^= 0x10;  // while it is busy
  });
  const Told save = bench.run("save");
  EXPECT_EQ(save.error, Error::bad_checksum);
  EXPECT_EQ(save.detail, "the answer to the command was lost: it may have been executed");
  bench.pass(1s);
  bench.run("position");
  EXPECT_EQ(bench.encoder.memory_version(), 1u);
}

// ---- Procedures

TEST_P(EncolinkRegister, ZeroIsHereAndSurvivesPowerOff) {
  Bench bench(testing::multi, wire);
  const Told zero = bench.run("zero");
  ASSERT_EQ(zero.error, Error::none) << zero.detail;
  EXPECT_EQ(zero.reading->singleturn, 0u);
  EXPECT_EQ(bench.encoder.memory_version(), 1u);
  bench.restart(PowerOn::skip);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0u);
  bench.shaft.put(7, 0x22345);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x10000u);
  EXPECT_EQ(bench.run("zero").error, Error::none);  // an offset on top of an offset
  EXPECT_EQ(bench.run("position").reading->singleturn, 0u);
}

TEST_P(EncolinkRegister, ZeroIsHereWhereverTheShaftStandsAndWhateverTheOffsetWas) {
  for (const OffsetSign sign : {OffsetSign::add, OffsetSign::subtract}) {
    for (const std::int64_t place : {0, 1, 0x7FFFF, 0x80000, 0xFFFFF}) {
      Format format = testing::multi;
      format.offset_sign = sign;
      Bench bench(format, wire);
      bench.shaft.put(-3, place);
      ASSERT_EQ(bench.run("memory-write", {0, 0xFEDCB}).error, Error::none);
      ASSERT_EQ(bench.run("zero").error, Error::none);
      EXPECT_EQ(bench.run("position").reading->singleturn, 0u);
    }
  }
}

TEST_P(EncolinkRegister, ZeroUntilPowerOff) {
  Bench bench(testing::single, wire);
  ASSERT_EQ(bench.run("zero", {0}).error, Error::none);
  EXPECT_EQ(bench.encoder.memory_version(), 0u);
  bench.restart(PowerOn::skip);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x12345u);
}

TEST_P(EncolinkRegister, ZeroWithTheWrongSignPutsTheOldOffsetBack) {
  Format subtracting = testing::single;
  subtracting.offset_sign = OffsetSign::subtract;
  Bench bench(subtracting, wire);
  bench.tell(testing::single);
  ASSERT_EQ(bench.run("memory-write", {0, 0x10000}).error, Error::none);
  const Told wrong = bench.run("zero");
  EXPECT_EQ(wrong.error, Error::cross_check_failed);
  EXPECT_NE(wrong.detail.find("offset_sign"), std::string::npos);
  EXPECT_EQ(bench.encoder.offset(), 0x10000u);
  bench.tell(subtracting);
  EXPECT_EQ(bench.run("zero").error, Error::none);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0u);
}

TEST_P(EncolinkRegister, ZeroNeedsAShaftAtRestAndAPosition) {
  Bench bench(testing::single, wire);
  for (const std::int32_t rpm : {600, 1, -1}) {
    bench.shaft.spin(rpm, bench.line.now());
    EXPECT_EQ(bench.run("zero").error, Error::invalid_argument) << rpm;
  }
  bench.shaft.spin(0, bench.line.now());
  bench.encoder.raise_alarms(status::signal_lost);
  EXPECT_EQ(bench.run("zero").error, Error::invalid_argument);
  EXPECT_EQ(bench.encoder.offset(), 0u);
}

TEST_P(EncolinkRegister, PresetsTheTurns) {
  Bench bench(testing::multi, wire);
  const Told preset = bench.run("preset-multiturn", {1234});
  ASSERT_EQ(preset.error, Error::none) << preset.detail;
  EXPECT_EQ(preset.reading->multiturn, 1234u);
  EXPECT_EQ(preset.reading->singleturn, 0x12345u);
  bench.restart(PowerOn::skip);
  EXPECT_EQ(bench.run("position").reading->multiturn, 1234u);

  Bench turnless(testing::single, wire);
  EXPECT_EQ(turnless.run("preset-multiturn").error, Error::unsupported);
  turnless.tell({});  // asked first
  EXPECT_EQ(turnless.run("preset-multiturn").error, Error::unsupported);
}

TEST_P(EncolinkRegister, ResetForgetsUntilPowerOff) {
  Bench bench(testing::multi, wire);
  ASSERT_EQ(bench.run("zero").error, Error::none);
  ASSERT_EQ(bench.run("reset").error, Error::none);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x12345u);
  bench.restart(PowerOn::skip);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0u);
}

TEST_P(EncolinkRegister, SaveIsLostWithThePowerWhileItIsBusy) {
  Bench bench(testing::multi, wire);
  ASSERT_EQ(bench.run("memory-write", {0, 0x10000}).error, Error::none);
  const Told save = bench.run("save", {}, [&](const auto&) {
    if (bench.emits == 100) bench.encoder.power_off(bench.line.now());
  });
  EXPECT_NE(save.error, Error::none);
  EXPECT_EQ(bench.encoder.memory_version(), 0u);
}

TEST_P(EncolinkRegister, SelfCalibrationShowsItsProgress) {
  Bench bench(testing::single, wire);
  bench.shaft.spin(120, bench.line.now());
  unsigned running = 0;
  const Told calibrate = bench.run("self-calibrate", {}, [&](const Conversation<std::uint8_t>& emitted) {
    running += testing::told_by(emitted).numbers.at("running") != 0 ? 1 : 0;
  });
  ASSERT_EQ(calibrate.error, Error::none) << calibrate.detail;
  EXPECT_GE(running, 8u);
  EXPECT_EQ(running, bench.emits);
  EXPECT_EQ(calibrate.numbers.at("calibrations"), 1);
  EXPECT_EQ(calibrate.numbers.at("running"), 0);
  EXPECT_GT(bench.took, calibration_time);
  for (unsigned count : {2u, 3u, 0u}) {
    EXPECT_EQ(bench.run("self-calibrate").numbers.at("calibrations"), count);
  }
}

TEST_P(EncolinkRegister, SelfCalibrationNeedsATurningShaft) {
  Bench bench(testing::single, wire);
  const Told calibrate = bench.run("self-calibrate");
  EXPECT_EQ(calibrate.error, Error::cross_check_failed);
  EXPECT_NE(calibrate.detail.find("turn the shaft"), std::string::npos);
}

TEST_P(EncolinkRegister, InfoTellsEverything) {
  Bench bench(testing::multi, wire);
  bench.tell({});
  const Told info = bench.run("info");
  ASSERT_EQ(info.error, Error::none) << info.detail;
  EXPECT_EQ(info.numbers.at("resolution"), 20);
  EXPECT_EQ(info.numbers.at("frame_bytes"), 7);
  EXPECT_EQ(info.numbers.at("firmware_major"), 1);
  EXPECT_EQ(info.numbers.at("firmware_minor"), 4);
  EXPECT_EQ(info.texts.at("serial_number"), "AK2A0001");
  EXPECT_DOUBLE_EQ(info.reals.at("temperature_c"), 35.0);
  EXPECT_DOUBLE_EQ(info.reals.at("speed_rpm"), 0.0);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);

  Bench old({20, 0, false}, wire);
  const Told identity = old.run("info");
  EXPECT_EQ(identity.error, Error::none);
  EXPECT_EQ(identity.numbers.count("firmware_major"), 0u);
}

}  // namespace
}  // namespace absenc::encolink
