// SPDX-License-Identifier: Apache-2.0
// Tests of procedures that access registers or send commands.
#include "absenc/protocol/biss/procedures.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absenc/protocol/biss/procedure_bench_test.hpp"

namespace absenc::biss {
namespace {

using testing::ProcedureBench;
using testing::ProcedureRun;

TEST(BissProcedures, RefusesImpossibleRegistersWithoutRequest) {
  ProcedureBench one;
  const auto refused = [&one](const ControlResults&) { EXPECT_EQ(one.encoder.answer_count(), 0u); };
  const Error no = Error::invalid_argument;
  // the last of the requested registers is beyond the end of the bank
  refused(one.ask<read_memory<Format>>({60, 0, 5}, no));
  // from this address on the encoder has fewer registers than are requested
  refused(one.ask<read_memory<Format>>({120, 0, 9}, no));
  refused(one.ask<read_memory<Format>>({64, 1, 1}, no));  // registers outside the banks are on bank 0
  refused(one.ask<write_memory<Format>>({72, 1, 7, 1}, no));
  refused(one.ask<write_memory<Format>>({72, 7, 1, 1}, no));
  refused(one.ask<write_memory<Format>>({68, 7, 0, 1}, no));  // the serial number is read only
  refused(one.ask<write_memory<Format>>({72, 7, 0, 0}, no));  // a register defined by the maker needs `force`
  refused(one.ask<write_memory<Format>>({3, 7, 1, 0}, no));
  EXPECT_EQ(one.ask<read_memory<Format>>({60, 0, 4}).bytes.size(), 4u);
  EXPECT_EQ(one.ask<read_memory<Format>>({120, 0, 8}).bytes.size(), 8u);
  EXPECT_EQ(one.ask<write_memory<Format>>({72, 7, 0, 1}).written, true);
  EXPECT_EQ(one.ask<write_memory<Format>>({3, 7, 1, 1}).written, true);
  EXPECT_EQ(one.ask<write_memory<Format>>({3, 7, 0, 0}).written, true);
  EXPECT_EQ(one.ask<write_memory<Format>>({3, 7, 0, 0}).written, false);
}

// BiSS C rev D2: an encoder takes up to 20 ms for a start bit; the host waits twice as long.
TEST(BissProcedures, WaitsFortyMillisecondsForStartBit) {
  const auto asked = [](std::uint16_t delay_us, Error expected) {
    Format format = testing::bits_24;
    format.register_delay_us = delay_us;
    ProcedureBench one(format);
    one.ask<read_setting<Format>, registers::profile>({}, expected);
  };
  asked(38'000, Error::none);
  asked(42'000, Error::busy);
}

// Some encoders send P = 1 (the next register is refused) after each register.
TEST(BissProcedures, ReadsOnAfterStopBit) {
  for (const StopBit stop_bit : {StopBit::next, StopBit::zero, StopBit::one}) {
    Format format = testing::bits_24;
    format.stop_bit = stop_bit;
    ProcedureBench one(format);
    EXPECT_EQ(one.ask<read_memory<Format>>({registers::device_id, 0, 6}).bytes.view()[2], 's');
    EXPECT_EQ(one.ask<write_memory<Format>>({3, 7, 2, 1}).written, true);
    EXPECT_EQ(one.ask<read_memory<Format>>({3, 2, 1}).value, 7);
  }
  EXPECT_EQ(ProcedureBench().ask<read_memory<Format>>({0, 9, 1}, Error::request_rejected).bytes.size(), 0u);
}

TEST(BissProcedures, EncoderExecutesCommandsOfTheStandard) {
  ProcedureBench one;
  const auto position = [&one] {
    FindPosition<Format> read(one.format);
    one.line.replace(one.node, read);
    EXPECT_TRUE(one.line.run(one.node, one.line.now() + 10s));
    return read.error();
  };
  one.ask<read_setting<Format>, registers::profile>({});
  EXPECT_EQ(position(), Error::none);
  EXPECT_EQ(one.ask<send_command<Format>>({0, 0}).executed, true);  // switches process data of all slaves off
  EXPECT_EQ(position(), Error::bad_checksum);
  EXPECT_EQ(one.ask<send_command<Format>>({1, 0}).executed, true);  // switches process data of slave 0 on
  EXPECT_EQ(position(), Error::none);
  EXPECT_EQ(one.ask<send_command<Format>>({1, 1}).executed, true);  // switches control communication of slave 0 off
  one.ask<read_setting<Format>, registers::profile>({}, Error::timeout);
  EXPECT_EQ(position(), Error::none);
  EXPECT_EQ(one.ask<send_command<Format>>({0, 1}).executed, true);  // switches control communication of all slaves on
  one.ask<read_setting<Format>, registers::profile>({});
  one.ask<send_command<Format>>({1, 2},
                                Error::request_rejected);  // the virtual encoder lacks command 2, which makers define
}

/// An encoder that loses the written value of register 3.
struct ForgetfulEncoder final : Machine<std::uint8_t> {
  explicit ForgetfulEncoder(VirtualEncoder& of) : encoder(of) {}
  void feed(const Event<std::uint8_t>& event) override {
    encoder.feed(event);
    encoder.memory()[3] = 0;
  }
  Step<std::uint8_t> next(Time now) override {
    const Step<std::uint8_t> step = encoder.next(now);
    encoder.memory()[3] = 0;
    return step;
  }
  VirtualEncoder& encoder;
};

TEST(BissProcedures, FailsWriteThatTheEncoderLoses) {
  const sim::Motion motion = sim::Motion::constant_speed(0, 600);
  VirtualEncoder encoder(testing::bits_24, motion);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  ForgetfulEncoder forgets(encoder);
  sim::Line<std::uint8_t> line(LinkKind::clocked, line_settings);
  line.attach(sim::NodeRole::device, forgets);
  const std::array<std::int64_t, 4> arguments{3, 7, 0, 0};
  std::vector<std::byte> storage(4096);
  ProcedureRun<write_memory<Format>> asking(testing::bits_24, arguments, storage);
  EXPECT_TRUE(line.run(line.attach(sim::NodeRole::host, asking), 10s));
  EXPECT_EQ(asking.error(), Error::cross_check_failed);
}

std::vector<std::string> names_of(const ControlResults& found) {
  struct Names final : FieldSink {
    void put(const FieldValue& value) override { names.emplace_back(value.info->name); }
    std::vector<std::string> names;
  } sink;
  register_fields.put(sink, found);
  return sink.names;
}

TEST(BissProcedures, ReportsOnlyFieldsWithValues) {
  using Names = std::vector<std::string>;
  ProcedureBench one;
  EXPECT_EQ(names_of(one.ask<read_memory<Format>>({60, 0, 1})), (Names{"slave_id", "bank", "address", "value"}));
  EXPECT_EQ(names_of(one.ask<read_memory<Format>>({60, 0, 2})),
            (Names{"slave_id", "bank", "address", "value", "data"}));
  EXPECT_EQ(names_of(one.ask<read_setting<Format>, registers::profile>()), (Names{"slave_id", "profile"}));
  EXPECT_EQ(names_of(one.ask<send_command<Format>>({0, 1})),
            (Names{"slaves", "more_slaves", "operation", "command", "broadcast", "executed"}));
}

// ---- Accepted frames

struct Seen {
  std::vector<Error> errors;
};

Procedure take_five_frames(ControlDialog<Format>& dialog, Seen& seen) {
  for (int i = 0; i < 5; ++i) {
    const Result<Reply> reply = co_await dialog.frame();
    seen.errors.push_back(reply.error());
  }
  co_return done;
}

struct FiveFrames final : author::Run<Protocol, Seen, take_five_frames> {
  using author::Run<Protocol, Seen, take_five_frames>::Run;
  void report(FieldSink&) const override {}
};

std::vector<Error> errors_of(const Format& format, const std::array<Reply, 5>& replies) {
  std::vector<std::byte> storage(4096);
  FiveFrames frames(format, {}, storage);
  Time now{};
  for (const Reply& reply : replies) {
    Step<std::uint8_t> step = frames.next(now);
    while (step.kind == Step<std::uint8_t>::Kind::configure) step = frames.next(now);
    EXPECT_EQ(step.kind, Step<std::uint8_t>::Kind::transfer);
    BitBuffer<512> frame;
    EXPECT_TRUE(encode(format, reply, frame));
    std::vector<std::uint8_t> bytes(frame.bytes().begin(), frame.bytes().end());
    bytes.resize(step.expect);
    now = step.at + 100us;
    frames.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    frames.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = bytes});
  }
  EXPECT_EQ(frames.next(now).kind, Step<std::uint8_t>::Kind::done);
  return frames.found().errors;
}

using Errors = std::vector<Error>;

TEST(BissProcedures, RejectsLifeCounterThatDoesNotAdvanceByOne) {
  const Format format{.word = testing::bits_24.word, .check = crc16};
  const auto errors = [&format](std::array<std::uint8_t, 5> counters) {
    std::array<Reply, 5> replies{};
    for (std::size_t i = 0; i < 5; ++i) replies[i] = {.ack_bits = 10, .life_counter = counters[i]};
    return errors_of(format, replies);
  };
  const Error none = Error::none;
  const Error check_life_counter = Error::sequence_mismatch;
  EXPECT_EQ(errors({61, 62, 63, 0, 1}), (Errors{none, none, none, none, none}));
  EXPECT_EQ(errors({41, 42, 42, 43, 45}), (Errors{none, none, check_life_counter, none, check_life_counter}));
}

// A frame may look late because its start bit was lost, so only a repeated delay is accepted.
TEST(BissProcedures, AcceptsLateFrameWhenTheNextIsAsLate) {
  const auto errors = [](std::array<unsigned, 5> ack_bits) {
    std::array<Reply, 5> replies{};
    for (std::size_t i = 0; i < 5; ++i) replies[i].ack_bits = ack_bits[i];
    return errors_of(testing::bits_24, replies);
  };
  const Error none = Error::none;
  const Error late = Error::truncated;
  EXPECT_EQ(errors({10, 10, 9, 10, 10}), (Errors{none, none, none, none, none}));
  // The first late frame had too few clocks, so the host compares the delays of the second and third frame.
  EXPECT_EQ(errors({10, 12, 12, 12, 14}), (Errors{none, late, late, none, late}));
}

}  // namespace
}  // namespace absenc::biss
