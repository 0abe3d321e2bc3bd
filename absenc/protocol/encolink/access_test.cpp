// SPDX-License-Identifier: Apache-2.0
// Tests that read and write registers of the virtual AksIM-2 through channels 2 and 3.
#include "absenc/protocol/encolink/procedures.hpp"

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/encolink/bench_test.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using testing::RawBytes;
using testing::RunResult;
using testing::says;
using PowerOn = Bench::PowerOn;
class EncolinkRegister : public testing::OnBothInterfaces {};
INSTANTIATE_TEST_SUITE_P(Interfaces, EncolinkRegister, ::testing::Values(Interface::uart, Interface::spi));

/// Returns a function that damages those replies whose number is in `frames`; the first reply has number 0.
author::testing::Tamper damaging(std::vector<unsigned> frames) {
  return [=](unsigned nth, RawBytes& reply) {
    if (std::find(frames.begin(), frames.end(), nth) != frames.end()) reply[1] ^= 0x10;
  };
}

/// Returns a function that finds the byte `right` in requests and replaces it by `wrong`, `times` times at most.
author::testing::Tamper replacing(std::uint8_t right, std::uint8_t wrong, int times) {
  return [=](unsigned, RawBytes& request) mutable {
    for (std::uint8_t& byte : request) {
      if (byte == right && times-- > 0) byte = wrong;
    }
  };
}

// While the host reads the longest register, each frame must still give a new position; the test counts the positions
// that are not new.
TEST_P(EncolinkRegister, ReadsRegisterWithoutLosingPositions) {
  for (const std::string_view settings : {testing::single, testing::multi}) {
    Bench bench(settings, interface);
    bench.shaft.spin(600, bench.line.now());
    bench.shaft.put(0, 0x12345);
    std::uint64_t last = 0;
    unsigned wrong = 0;
    Time begun{};  // time of the first emitted position; the procedure reads the identity before it
    const RunResult read = bench.run("memory-read", {registers[part_number].address}, [&](const auto& emitted) {
      RunResult now;
      now.take(emitted);
      if (last == 0) begun = bench.line.now();
      if (!now.reading || now.reading->singleturn <= last || now.numbers.at("singleturn") == 0) ++wrong;
      last = now.reading->singleturn;
    });
    ASSERT_EQ(read.error, Error::none) << read.detail;
    EXPECT_EQ(wrong, 0u);
    EXPECT_EQ(read.texts.at("register"), "order_number");
    EXPECT_EQ(read.numbers.at("length"), 20);
    // The procedure emits a position for each frame but the two of the identity and the last one.
    EXPECT_EQ(read.emits, read.frames - 2 - 1);
    EXPECT_EQ(bench.first_violation(), "");
    const auto size = static_cast<std::int64_t>(bench.encoder.format().frame_bytes());
    const Time frame = interface == Interface::uart
                           ? (2 + size) * uart_settings.character() + answer_time
                           : spi_lead + spi_settings.bits(static_cast<std::uint64_t>(8 * size)) + spi_pause;
    const Time ideal = static_cast<std::int64_t>(read.frames - 2 - 1) * frame;
    EXPECT_LE(bench.line.now() - begun, ideal + ideal / 100);
  }
}

TEST_P(EncolinkRegister, ReadsEveryRegisterOfTheTable) {
  Bench bench(testing::multi, interface);
  bench.condition(condition_temperature, -12);
  bench.shaft.spin(-60, bench.line.now());
  for (const Register& one : registers) {
    const RunResult read = bench.run("memory-read", {one.address});
    EXPECT_EQ(read.error, one.access == Access::write_only ? Error::request_rejected : Error::none) << one.name;
    if (read.error != Error::none) continue;
    EXPECT_EQ(read.numbers.at("length"), one.size);
    ASSERT_EQ(read.numbers.count(std::string(one.name)), 1u) << one.name;
    if (one.content == Content::celsius || one.content == Content::rpm) {
      EXPECT_EQ(read.numbers.at(std::string(one.name)), one.content == Content::rpm ? -60 : -12);
    }
  }
}

TEST_P(EncolinkRegister, InfoReportsIdentityAndRegisters) {
  Bench bench(testing::multi, interface);
  bench.tell("");
  const RunResult info = bench.run("info");
  ASSERT_EQ(info.error, Error::none) << info.detail;
  for (const auto& [name, number] : std::to_array<std::pair<std::string, std::int64_t>>({{"resolution", 20},
                                                                                         {"frame_bytes", 7},
                                                                                         {"firmware_major", 1},
                                                                                         {"firmware_minor", 4},
                                                                                         {"temperature_c", 35},
                                                                                         {"speed_rpm", 0}})) {
    EXPECT_EQ(info.numbers.at(name), number) << name;
  }
  EXPECT_EQ(info.texts.at("serial_number"), "AK2A0001");
  EXPECT_EQ(bench.first_violation(), "");
}

TEST_P(EncolinkRegister, ReadsWritesBackAndKeepsSavedOnes) {
  Bench bench(testing::multi, interface);
  const RunResult write = bench.run("memory-write", {0, 0x10000});
  ASSERT_EQ(write.error, Error::none) << write.detail;
  EXPECT_EQ(write.numbers.at("position_offset"), 0x10000);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x12345u + (1u << 16));
  constexpr std::array parameters{position_filter, position_filter_speed, velocity_filter, velocity_filter_speed,
                                  calibration_range};
  const auto value = [](RegisterIndex index) { return 0x160 + static_cast<std::int64_t>(index); };
  for (const RegisterIndex index : parameters) {
    ASSERT_EQ(bench.run("memory-write", {registers[index].address, value(index)}).error, Error::none);
  }
  ASSERT_EQ(bench.run("save").error, Error::none);
  bench.restart(PowerOn::skip);
  for (const RegisterIndex index : parameters) {
    const RunResult read = bench.run("memory-read", {registers[index].address});
    EXPECT_EQ(read.numbers.at(std::string(registers[index].name)), value(index));
  }
}

TEST_P(EncolinkRegister, ExplainsEachRefusal) {
  Bench bench(testing::multi, interface);
  const auto refusal = [&](std::int64_t address, std::int64_t size, std::int64_t value) {
    const RunResult write = bench.run("memory-write", {address, value, size});
    EXPECT_EQ(write.error, Error::request_rejected);
    return write.detail;
  };
  EXPECT_EQ(refusal(0x1234, 1, 0), text_of(AccessStatus::no_such_register));
  EXPECT_EQ(refusal(0x14, 4, 65536), text_of(AccessStatus::out_of_range));
  EXPECT_EQ(refusal(0x00, 4, 0xFFFFFFFF), text_of(AccessStatus::out_of_range));
  EXPECT_EQ(refusal(0x4C, 2, 0), text_of(AccessStatus::denied));
  EXPECT_EQ(refusal(0x1B, 2, 1), text_of(AccessStatus::denied));
  EXPECT_EQ(refusal(0x00, 2, 0), text_of(AccessStatus::byte_count));
  ASSERT_EQ(bench.run("memory-write", {0x2E, 1}).error, Error::none);
  EXPECT_EQ(refusal(0x00, 4, 0), text_of(AccessStatus::locked));
  EXPECT_EQ(bench.run("save").detail, text_of(AccessStatus::locked));
  ASSERT_EQ(bench.run("memory-write", {0x2E, 0}).error, Error::none);
  EXPECT_EQ(bench.run("memory-write", {0, 0}).error, Error::none);
}

TEST_P(EncolinkRegister, RefusesInvalidArgumentsWithoutRequest) {
  Bench bench(testing::multi, interface);
  EXPECT_EQ(bench.run("memory-read", {0x1234}).error, Error::invalid_argument);
  EXPECT_EQ(bench.run("memory-write", {0x2E, 256}).error, Error::invalid_argument);
  EXPECT_EQ(bench.run("memory-write", {0x49, 0x63}).error, Error::invalid_argument);
  EXPECT_EQ(bench.device.answer_count(), 0u);
}

TEST_P(EncolinkRegister, StopsAfterTwoSecondsOfBusy) {
  Bench bench(testing::single, interface);
  bench.condition(condition_busy, 1);
  const RunResult read = bench.run("memory-read", {0x4C});
  EXPECT_EQ(read.error, Error::busy);
  EXPECT_TRUE(says(read.detail, "busy for more than 2 s")) << read.detail;
  EXPECT_GT(read.emits, 20'000u);
  EXPECT_GT(read.took, busy_limit);
  EXPECT_LT(read.took, busy_limit + 10ms);
}

// If the first byte of the access is damaged, the encoder does not recognise it as an access; if the address is
// damaged, the checksum is wrong.
TEST_P(EncolinkRegister, RepeatsAccessThatArrivedDamaged) {
  for (const auto& [right, wrong, error, words] :
       std::to_array<std::tuple<std::uint8_t, std::uint8_t, Error, std::string_view>>(
           {{0xEF, 0xEE, Error::timeout, "the encoder ignores register accesses: positions go on"},
            {0x4C, 0x4D, Error::request_rejected, text_of(AccessStatus::read_checksum)}})) {
    for (const auto& [times, good] : std::to_array<std::pair<int, bool>>({{4, true}, {5, false}})) {
      Bench bench(testing::single, interface);
      bench.tampered.requests(replacing(right, wrong, times));
      const RunResult read = bench.run("memory-read", {0x4C});
      EXPECT_EQ(read.error, good ? Error::none : error) << times;
      EXPECT_EQ(read.detail, good ? "" : words);
    }
  }
}

TEST_P(EncolinkRegister, RestartsAccessAfterDamagedFrame) {
  for (const auto& [frames, error] : std::vector<std::pair<std::vector<unsigned>, Error>>{
           {{9, 60, 130}, Error::none},
           {{9, 10, 40, 70}, Error::none},
           {{9, 10, 40, 70, 100}, Error::bad_checksum},  // this row: all five attempts of the register access fail
           {{9, 10, 11}, Error::bad_checksum}}) {        // this row: three damaged frames in a row end the command
    Bench bench(testing::single, interface);
    bench.tampered.replies(damaging(frames));
    const RunResult read = bench.run("memory-read", {0x4C});
    EXPECT_EQ(read.error, error) << read.detail;
    EXPECT_EQ(read.numbers.count("temperature_c"), error == Error::none ? 1u : 0u);
  }
}

TEST_P(EncolinkRegister, ReportsUnpluggedEncoder) {
  const Error gone = interface == Interface::uart ? Error::timeout : Error::line_stuck;
  struct Case {
    std::string_view command;
    std::vector<std::int64_t> arguments;
    unsigned after;  // number of emitted positions after which the test switches the encoder off
    std::string_view words;
  };
  for (const Case& one : std::vector<Case>{
           {"memory-write", {0, 0x10000000}, 18, "stopped answering in the middle of a register write"},
           {"memory-write", {0, 0x10000000}, 5, interface == Interface::uart ? "during a register access" : "MISO"},
           {"save", {}, 100, "the answer to the command was lost: it may have been executed"},
           {"save", {}, 5, interface == Interface::uart ? "during a register access" : "MISO"}}) {
    Bench bench(testing::single, interface);
    unsigned emits = 0;
    const RunResult told = bench.run(one.command, one.arguments, [&](const auto&) {
      if (++emits == one.after) bench.device.power_off(bench.line.now());
    });
    EXPECT_EQ(told.error, gone);
    EXPECT_TRUE(says(told.detail, one.words)) << told.detail;
    EXPECT_FALSE(told.reading);
    EXPECT_EQ(bench.device.memory_version(), 0u);
  }
  // The host receives no identity, so it writes nothing.
  Bench bench(testing::multi, interface);
  bench.tampered.replies([](unsigned, RawBytes& reply) { reply.clear(); });
  const RunResult save = bench.run("save");
  EXPECT_NE(save.error, Error::none);
  EXPECT_FALSE(says(save.detail, "may have been executed")) << save.detail;
}

// The answer to the write is lost, but the host reads the register back and sees that it was written.
TEST_P(EncolinkRegister, ReadsBackBeforeRepeatingWrite) {
  Bench bench(testing::single, interface);
  bench.tampered.replies(damaging({22}));
  unsigned written = 0;
  bench.tampered.requests([&](unsigned, RawBytes& request) {
    for (const std::uint8_t byte : request) written += byte == 0x58 ? 1 : 0;
  });
  const RunResult write = bench.run("memory-write", {0, 0x10000});
  EXPECT_EQ(write.error, Error::none) << write.detail;
  EXPECT_EQ(bench.encoder.offset(), 0x10000u);
  EXPECT_EQ(written, 1u);
}

// The encoder ignores an unknown operation, so the register keeps its value.
TEST_P(EncolinkRegister, RepeatsWriteThatWasNotExecuted) {
  for (const auto& [times, error] :
       std::to_array<std::pair<int, Error>>({{2, Error::none}, {3, Error::cross_check_failed}})) {
    Bench bench(testing::single, interface);
    bench.tampered.requests(replacing(0x58, 0x5A, times));
    EXPECT_EQ(bench.run("memory-write", {0, 0x10000}).error, error);
    EXPECT_EQ(bench.encoder.offset(), error == Error::none ? 0x10000u : 0u);
  }
}

// The sequence of frames: frames 0 and 1 read the identity, frame 2 resets the channels, cycles of 7 frames follow.
TEST_P(EncolinkRegister, AcceptsAnswerAfterEightIdleCycles) {
  for (const auto& [more, asked] : std::to_array<std::pair<unsigned, unsigned>>({{7, 1}, {8, 2}})) {
    Bench bench(testing::single, interface);
    std::vector<std::uint8_t> answer;
    RawBytes cycle(7);
    unsigned left = more;
    bench.tampered.replies([&](unsigned frame, RawBytes& reply) {
      if (frame < 3) return;
      const unsigned at = (frame - 3) % 7;
      if (at == 5) answer.push_back(reply[4]);
      if (at == 5 && answer[0] == channel3::read_ready && left > 0) {
        --left;
        reply[4] = channel3::idle;
      } else if (at == 5) {
        reply[4] = answer[0];
        answer.erase(answer.begin());
      }
      if (at == 6) reply[4] = checksum(Bytes(cycle).first(6));
      cycle[at] = reply[4];
    });
    unsigned heard = 0;
    bench.tampered.requests([&](unsigned, RawBytes& request) {
      for (const std::uint8_t byte : request) heard += byte == 0x59 ? 1 : 0;
    });
    bench.run("memory-read", {0x4C});
    EXPECT_EQ(heard >= 2, asked == 2) << more;
  }
}

/// Replaces the channel 3 byte of each cycle of channel 2, which takes seven frames, on a UART.
struct OnChannel3 {
  OnChannel3(Bench& bench, std::function<std::uint8_t(std::uint8_t)> change) : change_(std::move(change)) {
    bench.tampered.requests([this](unsigned, RawBytes& request) {
      if (request[0] == 0xAA) at_ = 7;  // the channel 2 byte in the reply to a reset is not in the new cycle yet
    });
    bench.tampered.replies([this](unsigned, RawBytes& reply) {
      if (at_ == 7) {
        at_ = 0;
        return;
      }
      if (reply.size() != 5) return;
      if (at_ == 5) reply[4] = change_(reply[4]);
      if (at_ == 6) reply[4] = checksum(Bytes(cycle_).first(6));
      cycle_[at_] = reply[4];
      at_ = (at_ + 1) % 7;
    });
  }
  std::function<std::uint8_t(std::uint8_t)> change_;
  unsigned at_ = 0;
  RawBytes cycle_ = RawBytes(7);
};

TEST(EncolinkAccess, RejectsAnswerWithoutReady) {
  Bench bench(testing::single);
  const OnChannel3 strange(bench, [](std::uint8_t told) { return told == channel3::read_ready ? 0x77 : told; });
  const RunResult read = bench.run("memory-read", {0x4C});
  EXPECT_EQ(read.error, Error::unexpected_reply);
  EXPECT_EQ(read.detail, "channel 3 says neither idle nor busy nor ready");
}

// In the first row the encoder reports that the ring is too eccentric. In the second row the encoder's counter of
// self-calibrations never changes.
TEST(EncolinkAccess, ReportsFailedAndEndlessSelfCalibration) {
  for (const auto& [says, error, words] : std::to_array<std::tuple<std::uint8_t, Error, std::string_view>>(
           {{calibration::out_of_range, Error::cross_check_failed, "too eccentric"},
            {0, Error::timeout, "does not end"}})) {
    Bench bench(testing::single);
    unsigned reads = 0;
    unsigned step = 0;  // next byte of the encoder's answer: 0 ready, 1 status, 2 value
    const OnChannel3 changed(bench, [&, status = says](std::uint8_t told) {
      if (step == 0)
        step = told == channel3::read_ready ? 1 : 0;
      else if (step == 1)
        step = told == static_cast<std::uint8_t>(AccessStatus::ok) ? 2 : 0;
      else if (step == 2)
        return step = 0, reads++ == 0 ? std::uint8_t{0} : status;
      return told;
    });
    const RunResult told = bench.run("self-calibrate");
    EXPECT_EQ(told.error, error);
    EXPECT_TRUE(testing::says(told.detail, words)) << told.detail;
    // the timeout is longer than the 10 s within which the vendor wants the shaft turned
    EXPECT_EQ(told.took > 10s, error == Error::timeout);
  }
}

TEST(EncolinkAccess, RefusesImpossibleWritesWithoutRequest) {
  Bench bench("resolution=20 multiturn_bits=12");
  const Register* text =
      std::find_if(registers.begin(), registers.end(), [](const Register& one) { return one.size > 8; });
  ASSERT_NE(text, registers.end());
  for (const std::int64_t address : {std::int64_t{0x1234}, std::int64_t{text->address}}) {
    const RunResult written = bench.run("memory-write", {address, 0});
    EXPECT_EQ(written.error, Error::invalid_argument);
    EXPECT_TRUE(says(written.detail, "how many bytes")) << written.detail;
  }
  const RunResult preset = bench.run("preset-multiturn", {4096});
  EXPECT_EQ(preset.error, Error::invalid_argument);
  EXPECT_TRUE(says(preset.detail, "not so many bits")) << preset.detail;
}

TEST_P(EncolinkRegister, CommandReportsPositionWithoutStatus) {
  Bench bench(testing::single, interface);
  const RunResult save = bench.run("save");
  EXPECT_EQ(save.numbers.count("singleturn"), 1u);
  EXPECT_EQ(save.numbers.count("status"), 0u);
}

TEST_P(EncolinkRegister, PresetFailsWhileShaftTurns) {
  Bench bench(testing::multi, interface);
  bench.shaft.spin(30'000, bench.line.now());
  const RunResult preset = bench.run("preset-multiturn", {1234});
  EXPECT_EQ(preset.error, Error::cross_check_failed);
  EXPECT_TRUE(says(preset.advice, "hold the shaft still")) << preset.advice;
}

TEST_P(EncolinkRegister, NeverRepeatsCommand) {
  Bench bench(testing::single, interface);
  bench.tampered.replies(damaging({100}));  // frame 100 comes while the encoder is busy with saving
  const RunResult save = bench.run("save");
  EXPECT_EQ(save.error, Error::bad_checksum);
  EXPECT_EQ(save.detail, "the answer to the command was lost: it may have been executed");
  bench.pass(1s);
  bench.run("position");
  EXPECT_EQ(bench.device.memory_version(), 1u);
}

// The encoder may still send data bytes after it refused a register access, when the next access begins.
author::Procedure read_twice(Dialog& dialog, ProcedureState& found) {
  const AccessOutcome refused = co_await attempt_read(dialog, found, 0x1234, 20);
  if (refused != AccessOutcome::refused) co_return found.why;
  const AccessOutcome good = co_await attempt_read(dialog, found, registers[temperature].address, 2);
  co_return good == AccessOutcome::good ? author::done : found.why;
}

struct Twice {
  using Format = encolink::Format;
  using Dialog = encolink::Dialog;
};

TEST_P(EncolinkRegister, AccessesRegisterAfterRefusal) {
  Bench bench(testing::multi, interface);
  std::array<std::byte, 4000> frames{};
  author::Run<Twice, ProcedureState, read_twice> twice(bench.encoder.format(), {}, frames);
  EXPECT_EQ(bench.run(twice).error, Error::none);
  EXPECT_EQ(load_big_endian(twice.found().data), 350u);
  EXPECT_EQ(bench.first_violation(), "");
}

}  // namespace
}  // namespace absenc::encolink
