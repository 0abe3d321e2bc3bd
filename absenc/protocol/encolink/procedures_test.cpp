// SPDX-License-Identifier: Apache-2.0
// Register conversations against the virtual AksIM-2 in virtual time, on both wires.
#include "absenc/protocol/encolink/procedures.hpp"

#include <gtest/gtest.h>

#include "absenc/protocol/encolink/bench_test.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using testing::report;
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
  ReadRegister read(bench.format, wire, 0x4C);
  std::uint64_t last = 0;
  unsigned wrong = 0;
  bench.run(read, [&] {
    if (read.reading() == nullptr || read.reading()->singleturn <= last) ++wrong;
    last = read.reading()->singleturn;
  });
  ASSERT_EQ(read.error(), Error::none) << read.detail();
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(bench.emits, read.frames() - 1);
  const testing::Fields fields = report(read);
  EXPECT_EQ(fields.texts.at("register"), "temperature_c");
  EXPECT_EQ(fields.numbers.at("address"), 0x4C);
  EXPECT_DOUBLE_EQ(fields.reals.at("temperature_c"), 35.0);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST_P(EncolinkRegister, SignedTenthsGoBelowZero) {
  Bench bench(testing::single, wire, {.temperature = -123});
  EXPECT_DOUBLE_EQ(report(bench.conversed<ReadRegister>(0x4Cu)).reals.at("temperature_c"), -12.3);
  bench.shaft.spin(-60, bench.line.now());
  EXPECT_DOUBLE_EQ(report(bench.conversed<ReadRegister>(0x50u)).reals.at("speed_rpm"), -60.0);
}

TEST_P(EncolinkRegister, EveryRegisterIsReadAsTheTableSays) {
  Bench bench(testing::multi, wire);
  for (const Register& one : registers) {
    const ReadRegister read = bench.conversed<ReadRegister>(std::uint32_t{one.address});
    if (one.access == Access::write_only) {
      EXPECT_EQ(read.error(), Error::request_rejected) << one.name;
      continue;
    }
    ASSERT_EQ(read.error(), Error::none) << one.name;
    EXPECT_EQ(read.data().size(), one.size);
    EXPECT_EQ(report(read).numbers.count(std::string(one.name)), 1u) << one.name;
  }
}

TEST_P(EncolinkRegister, WritesAreReadBack) {
  Bench bench(testing::multi, wire);
  const WriteRegister write = bench.conversed<WriteRegister>(0u, std::uint16_t{0}, 0x10000ull);
  ASSERT_EQ(write.error(), Error::none) << write.detail();
  EXPECT_EQ(bench.encoder.offset(), 0x10000u);
  EXPECT_EQ(report(write).numbers.at("position_offset"), 0x10000);
  EXPECT_EQ(bench.conversed<ReadPosition>().reading()->singleturn, 0x12345u + (1u << 16));
}

TEST_P(EncolinkRegister, EachRefusalHasItsSentence) {
  Bench bench(testing::multi, wire);
  const auto refusal = [&](std::uint32_t address, std::uint16_t size, std::uint64_t value) {
    const WriteRegister write = bench.conversed<WriteRegister>(address, size, value);
    EXPECT_EQ(write.error(), Error::request_rejected);
    return write.detail();
  };
  EXPECT_EQ(refusal(0x1234, 1, 0), text_of(AccessStatus::no_such_register));
  EXPECT_EQ(refusal(0x14, 4, 65536), text_of(AccessStatus::out_of_range));
  EXPECT_EQ(refusal(0x4C, 2, 0), text_of(AccessStatus::denied));
  EXPECT_EQ(refusal(0x00, 2, 0), text_of(AccessStatus::byte_count));
  ASSERT_EQ(bench.conversed<WriteRegister>(0x2Eu, std::uint16_t{0}, 1ull).error(), Error::none);
  EXPECT_EQ(refusal(0x00, 4, 0), text_of(AccessStatus::locked));
  EXPECT_EQ(bench.conversed<SendCommand>(commands::save).detail(), text_of(AccessStatus::locked));
  ASSERT_EQ(bench.conversed<WriteRegister>(0x2Eu, std::uint16_t{0}, 0ull).error(), Error::none);
  EXPECT_EQ(bench.conversed<WriteRegister>(0u, std::uint16_t{0}, 0ull).error(), Error::none);
}

TEST_P(EncolinkRegister, WhatCannotBeAskedIsTheCallersFault) {
  Bench bench(testing::multi, wire);
  EXPECT_EQ(bench.conversed<ReadRegister>(0x1234u).error(), Error::invalid_argument);
  EXPECT_EQ(bench.conversed<WriteRegister>(0x2Eu, std::uint16_t{0}, 256ull).error(), Error::invalid_argument);
  EXPECT_EQ(bench.conversed<WriteRegister>(0x49u, std::uint16_t{0}, 0x63ull).error(), Error::invalid_argument);
  EXPECT_EQ(bench.encoder.answered(), 0u);
}

TEST_P(EncolinkRegister, BusyForEverEndsWhilePositionsGoOn) {
  Bench bench(testing::single, wire, {.busy_for_ever = true});
  const ReadRegister read = bench.conversed<ReadRegister>(0x4Cu);
  EXPECT_EQ(read.error(), Error::busy);
  EXPECT_NE(read.detail().find("busy for more than 2 s"), std::string_view::npos);
  EXPECT_GT(bench.emits, 20'000u);
  EXPECT_GT(bench.took, busy_limit);
  EXPECT_LT(bench.took, busy_limit + 10ms);
  EXPECT_EQ(bench.conversed<ReadPosition>().error(), Error::none);
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
  EXPECT_EQ(bench.conversed<ReadRegister>(0x4Cu).error(), Error::none);
  deaf.damaged = 1000;
  const ReadRegister read = bench.conversed<ReadRegister>(0x4Cu);
  EXPECT_EQ(read.error(), Error::timeout);
  EXPECT_EQ(read.detail(), "the encoder ignores register accesses: positions go on");
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
  EXPECT_EQ(bench.conversed<ReadRegister>(0x4Cu).error(), Error::none);
  noisy.damaged = 1000;
  const ReadRegister read = bench.conversed<ReadRegister>(0x4Cu);
  EXPECT_EQ(read.error(), Error::request_rejected);
  EXPECT_EQ(read.detail(), text_of(AccessStatus::read_checksum));
}

TEST_P(EncolinkRegister, DamagedFramesBeginTheAccessAnew) {
  Bench bench(testing::single, wire);
  bench.device.set([](unsigned frame, std::vector<std::uint8_t>& reply) {
    if (frame == 9 || frame == 60 || frame == 130) reply[1] ^= 0x10;
  });
  const ReadRegister read = bench.conversed<ReadRegister>(0x4Cu);
  ASSERT_EQ(read.error(), Error::none) << read.detail();
  EXPECT_DOUBLE_EQ(report(read).reals.at("temperature_c"), 35.0);
}

TEST_P(EncolinkRegister, UnpluggedInTheMiddleOfAWrite) {
  Bench bench(testing::single, wire);
  WriteRegister write(bench.format, wire, 0, 0, 0x10000000);
  bench.run(write, [&] {
    if (bench.emits == 18) bench.encoder.power_off(bench.line.now());
  });
  EXPECT_EQ(write.error(), wire == Wire::uart ? Error::timeout : Error::line_stuck);
  EXPECT_NE(write.detail().find("stopped answering in the middle of a register write"), std::string_view::npos);
  EXPECT_EQ(write.reading(), nullptr);
}

// The answer to the write is lost, so it must be read back before it is written again.
TEST_P(EncolinkRegister, AWriteIsNotRepeatedBlindly) {
  Bench bench(testing::single, wire);
  bench.device.set([](unsigned frame, std::vector<std::uint8_t>& reply) {
    if (frame == 22) reply[1] ^= 0x10;
  });
  const WriteRegister write = bench.conversed<WriteRegister>(0u, std::uint16_t{0}, 0x10000ull);
  EXPECT_EQ(write.error(), Error::none) << write.detail();
  EXPECT_EQ(bench.encoder.offset(), 0x10000u);
}

// After a refusal bytes of data may follow: the next access must not begin among them.
TEST_P(EncolinkRegister, AnAccessAfterARefusal) {
  struct Twice final : Stream {
    Twice(const Format& format, Wire wire) : Stream(format, wire, 3) { submit(read_request(0x1234, 20)); }
    void on_access(Error error, std::string_view detail) override {
      if (!refused) {
        refused = error == Error::request_rejected;
        return submit(read_request(0x4C, 2));
      }
      value = load_big_endian(access().data());
      finish(error, detail);
    }
    void report(FieldSink&) const override {}
    bool refused = false;
    std::uint64_t value = 0;
  };
  Bench bench(testing::multi, wire);
  Twice twice(bench.format, wire);
  bench.run(twice);
  EXPECT_EQ(twice.error(), Error::none);
  EXPECT_EQ(twice.value, 350u);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST_P(EncolinkRegister, ACommandIsNeverRepeated) {
  Bench bench(testing::single, wire);
  bench.device.set([](unsigned frame, std::vector<std::uint8_t>& reply) {
    if (frame == 100) reply[1] ^= 0x10;  // while it is busy
  });
  const SendCommand save = bench.conversed<SendCommand>(commands::save);
  EXPECT_EQ(save.error(), Error::bad_checksum);
  EXPECT_EQ(save.detail(), "the answer to the command was lost: it may have been executed");
  bench.pass(1s);
  bench.conversed<ReadPosition>();
  EXPECT_EQ(bench.encoder.memory_version(), 1u);
}

// ---- Procedures

TEST_P(EncolinkRegister, ZeroIsHereAndSurvivesPowerOff) {
  Bench bench(testing::multi, wire);
  const Zero zero = bench.conversed<Zero>();
  ASSERT_EQ(zero.error(), Error::none) << zero.detail();
  EXPECT_EQ(zero.reading()->singleturn, 0u);
  EXPECT_EQ(bench.encoder.memory_version(), 1u);
  bench.encoder.power_off(bench.line.now());
  bench.encoder.power_on(bench.line.now(), PowerOn::skip);
  EXPECT_EQ(bench.conversed<ReadPosition>().reading()->singleturn, 0u);
  bench.shaft.put(7, 0x22345);
  EXPECT_EQ(bench.conversed<ReadPosition>().reading()->singleturn, 0x10000u);
  EXPECT_EQ(bench.conversed<Zero>().error(), Error::none);  // an offset on top of an offset
  EXPECT_EQ(bench.conversed<ReadPosition>().reading()->singleturn, 0u);
}

TEST_P(EncolinkRegister, ZeroUntilPowerOff) {
  Bench bench(testing::single, wire);
  ASSERT_EQ(bench.conversed<Zero>(Offset{}, Keep::until_power_off).error(), Error::none);
  EXPECT_EQ(bench.encoder.memory_version(), 0u);
  bench.encoder.power_off(bench.line.now());
  bench.encoder.power_on(bench.line.now(), PowerOn::skip);
  EXPECT_EQ(bench.conversed<ReadPosition>().reading()->singleturn, 0x12345u);
}

TEST_P(EncolinkRegister, ZeroWithTheWrongSignPutsTheOldOffsetBack) {
  Bench bench(testing::single, wire, {.offset = {.sign = OffsetSign::subtract}});
  ASSERT_EQ(bench.conversed<WriteRegister>(0u, std::uint16_t{0}, 0x10000ull).error(), Error::none);
  const Zero wrong = bench.conversed<Zero>(Offset{});
  EXPECT_EQ(wrong.error(), Error::cross_check_failed);
  EXPECT_NE(wrong.detail().find("offset_sign"), std::string_view::npos);
  EXPECT_EQ(bench.encoder.offset(), 0x10000u);
  EXPECT_EQ(bench.conversed<Zero>(Offset{.sign = OffsetSign::subtract}).error(), Error::none);
  EXPECT_EQ(bench.conversed<ReadPosition>().reading()->singleturn, 0u);
}

TEST_P(EncolinkRegister, ZeroNeedsAShaftAtRestAndAPosition) {
  Bench bench(testing::single, wire);
  bench.shaft.spin(600, bench.line.now());
  EXPECT_EQ(bench.conversed<Zero>().error(), Error::invalid_argument);
  bench.shaft.spin(0, bench.line.now());
  bench.encoder.raise_alarms(status::signal_lost);
  EXPECT_EQ(bench.conversed<Zero>().error(), Error::invalid_argument);
  EXPECT_EQ(bench.encoder.offset(), 0u);
}

TEST_P(EncolinkRegister, PresetsTheTurns) {
  Bench bench(testing::multi, wire);
  const PresetMultiturn preset = bench.conversed<PresetMultiturn>(std::uint16_t{1234});
  ASSERT_EQ(preset.error(), Error::none) << preset.detail();
  EXPECT_EQ(preset.reading()->multiturn, 1234u);
  EXPECT_EQ(preset.reading()->singleturn, 0x12345u);
  bench.encoder.power_off(bench.line.now());
  bench.encoder.power_on(bench.line.now(), PowerOn::skip);
  EXPECT_EQ(bench.conversed<ReadPosition>().reading()->multiturn, 1234u);

  Bench turnless(testing::single, wire);
  EXPECT_EQ(turnless.conversed<PresetMultiturn>().error(), Error::unsupported);
  turnless.format = Format{};  // asked first
  EXPECT_EQ(turnless.conversed<PresetMultiturn>().error(), Error::unsupported);
}

TEST_P(EncolinkRegister, ResetForgetsUntilPowerOff) {
  Bench bench(testing::multi, wire);
  ASSERT_EQ(bench.conversed<Zero>().error(), Error::none);
  ASSERT_EQ(bench.conversed<SendCommand>(commands::reset).error(), Error::none);
  EXPECT_EQ(bench.conversed<ReadPosition>().reading()->singleturn, 0x12345u);
  bench.encoder.power_off(bench.line.now());
  bench.encoder.power_on(bench.line.now(), PowerOn::skip);
  EXPECT_EQ(bench.conversed<ReadPosition>().reading()->singleturn, 0u);
}

TEST_P(EncolinkRegister, SaveIsLostWithThePowerWhileItIsBusy) {
  Bench bench(testing::multi, wire);
  ASSERT_EQ(bench.conversed<WriteRegister>(0u, std::uint16_t{0}, 0x10000ull).error(), Error::none);
  SendCommand save(bench.format, wire, commands::save);
  bench.run(save, [&] {
    if (bench.emits == 100) bench.encoder.power_off(bench.line.now());
  });
  EXPECT_NE(save.error(), Error::none);
  EXPECT_EQ(bench.encoder.memory_version(), 0u);
}

TEST_P(EncolinkRegister, SelfCalibrationShowsItsProgress) {
  Bench bench(testing::single, wire);
  bench.shaft.spin(120, bench.line.now());
  SelfCalibrate calibrate(bench.format, wire);
  unsigned running = 0;
  bench.run(calibrate, [&] { running += report(calibrate).numbers.at("running") != 0 ? 1 : 0; });
  ASSERT_EQ(calibrate.error(), Error::none) << calibrate.detail();
  EXPECT_GE(running, 8u);
  EXPECT_EQ(running, bench.emits);
  EXPECT_EQ(report(calibrate).numbers.at("calibrations"), 1);
  EXPECT_EQ(report(calibrate).numbers.at("running"), 0);
  EXPECT_GT(bench.took, calibration_time);
  for (unsigned count : {2u, 3u, 0u}) {
    EXPECT_EQ(report(bench.conversed<SelfCalibrate>()).numbers.at("calibrations"), count);
  }
}

TEST_P(EncolinkRegister, SelfCalibrationNeedsATurningShaft) {
  Bench bench(testing::single, wire);
  const SelfCalibrate calibrate = bench.conversed<SelfCalibrate>();
  EXPECT_EQ(calibrate.error(), Error::cross_check_failed);
  EXPECT_NE(calibrate.detail().find("turn the shaft"), std::string_view::npos);
}

TEST_P(EncolinkRegister, InfoTellsEverything) {
  Bench bench(testing::multi, wire);
  bench.format = Format{};
  const ReadInfo info = bench.conversed<ReadInfo>();
  ASSERT_EQ(info.error(), Error::none) << info.detail();
  const testing::Fields fields = report(info);
  EXPECT_EQ(fields.numbers.at("resolution"), 20);
  EXPECT_EQ(fields.numbers.at("frame_bytes"), 7);
  EXPECT_EQ(fields.numbers.at("firmware_major"), 1);
  EXPECT_EQ(fields.numbers.at("firmware_minor"), 4);
  EXPECT_EQ(fields.texts.at("serial_number"), "AK2A0001");
  EXPECT_DOUBLE_EQ(fields.reals.at("temperature_c"), 35.0);
  EXPECT_DOUBLE_EQ(fields.reals.at("speed_rpm"), 0.0);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);

  Bench old({20, 0, false}, wire);
  const ReadInfo identity = old.conversed<ReadInfo>();
  EXPECT_EQ(identity.error(), Error::none);
  EXPECT_EQ(report(identity).numbers.count("firmware_major"), 0u);
}

}  // namespace
}  // namespace absenc::encolink
