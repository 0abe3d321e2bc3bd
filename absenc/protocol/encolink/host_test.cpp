// SPDX-License-Identifier: Apache-2.0
// Tests of positions, the identity and channel 2 with the virtual AksIM-2.
#include "absenc/protocol/encolink/host.hpp"

#include "absenc/protocol/encolink/bench_test.hpp"
#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using testing::RawBytes;
using testing::RunResult;
using testing::says;
using PowerOn = Bench::PowerOn;
class EncolinkHost : public testing::OnBothInterfaces {};
INSTANTIATE_TEST_SUITE_P(Interfaces, EncolinkHost, ::testing::Values(Interface::uart, Interface::spi));

TEST(EncolinkHostUart, ReadsPositionWithoutExtraTime) {
  Bench bench;
  const RunResult read = bench.run("position");
  EXPECT_EQ(read.took, (2 + 7) * 10us + answer_time);
  ASSERT_TRUE(read.reading);
  EXPECT_EQ(read.reading->singleturn, 0x12345u);
  EXPECT_EQ(read.reading->multiturn, 7u);
  EXPECT_EQ(read.reading->latched, 20us);
  EXPECT_EQ(read.reading->received, 95us);
}

TEST(EncolinkHostSpi, LatchesPositionWhenNcsFalls) {
  Bench bench(testing::single, Interface::spi);
  bench.pass(1ms);
  const RunResult read = bench.run("position");
  ASSERT_TRUE(read.reading);
  // The host waits for `spi_pause` before its first transfer, because it does not know when the transfer before it
  // ended.
  EXPECT_EQ(read.reading->latched, 1ms + spi_pause);
  EXPECT_EQ(read.reading->received, 1ms + spi_pause + spi_lead + 40us);
  EXPECT_EQ(read.took, spi_pause + spi_lead + 40us);
}

TEST_P(EncolinkHost, ExplainsEachError) {
  const auto none = [](unsigned, RawBytes&) {};
  const auto all = [](std::uint8_t byte) {
    return [byte](unsigned, RawBytes& reply) { reply.assign(reply.size(), byte); };
  };
  struct Case {
    std::string_view interfaces;
    std::string_view told;
    author::testing::Tamper tamper;
    Error error;
    std::string_view words;
  };
  for (const Case& one :
       std::vector<Case>{// Bit 0 of 0x12345 is set and would be padding.
                         {"us", "resolution=19 multiturn_bits=16", none, Error::out_of_range, "resolution"},
                         {"us", "multiturn_bits=0", none, Error::unexpected_reply, "multiturn_bits"},
                         {"us", "resolution=17", none, Error::unexpected_reply, "another resolution"},
                         {"u", testing::multi, [](unsigned, RawBytes& reply) { reply.resize(4); }, Error::wrong_length,
                          "ended early"},
                         {"u", testing::multi, [](unsigned, RawBytes& reply) { reply.clear(); }, Error::timeout, ""},
                         {"u", "", [](unsigned, RawBytes& reply) { reply.resize(7); }, Error::wrong_length,
                          "did not identify itself"},
                         {"s", testing::multi, all(0x00), Error::line_stuck, "MISO stayed low"},
                         {"s", testing::multi, all(0xFF), Error::line_stuck, "MISO stayed high"}}) {
    if (one.interfaces.find(interface == Interface::uart ? 'u' : 's') == std::string_view::npos) continue;
    Bench bench(testing::multi, interface);
    bench.tampered.replies(one.tamper);
    bench.tell(one.told);
    const RunResult read = bench.run("position");
    EXPECT_EQ(read.error, one.error) << one.words;
    EXPECT_TRUE(says(read.detail, one.words)) << read.detail;
    EXPECT_FALSE(read.reading);
  }
}

TEST(EncolinkHostUart, TimesOutWithoutReply) {
  Bench bench;
  bench.device.power_off(bench.line.now());
  EXPECT_EQ(bench.run("position").took, 20us + answer_limit);
}

// ---- The identity

TEST_P(EncolinkHost, ReadsIdentityWhenFormatIsUnknown) {
  for (const std::string_view real : {testing::single, testing::multi, std::string_view("resolution=17")}) {
    Bench bench(real, interface);
    bench.tell("");
    const RunResult read = bench.run("position");
    ASSERT_EQ(read.error, Error::none) << read.detail;
    const Format& format = bench.encoder.format();
    EXPECT_EQ(read.reading->singleturn_bits, format.resolution);
    EXPECT_EQ(read.reading->singleturn, bench.encoder.measure(bench.line.now()).singleturn);
    EXPECT_EQ(read.reading->multiturn_bits, static_cast<unsigned>(format.multiturn_bits));
    EXPECT_EQ(read.frames, 3u);
  }
}

TEST_P(EncolinkHost, IdentityOverridesOptionsInInfoAndIdentify) {
  Bench bench("resolution=17 multiturn_bits=0", interface);
  bench.tell("resolution=20 multiturn_bits=0");
  const RunResult info = bench.run("info");
  ASSERT_TRUE(info.reading) << info.detail;
  EXPECT_EQ(info.numbers.at("resolution"), 17);
  EXPECT_EQ(info.reading->singleturn_bits, 17u);
  EXPECT_EQ(info.reading->multiturn_bits, 0u);
  const RunResult identify = bench.run("identify");
  EXPECT_EQ(identify.numbers.at("resolution"), 17);
  EXPECT_EQ(identify.numbers.at("frame_bytes"), 5);
  EXPECT_EQ(identify.texts.at("part_number"), "MB080SLA17MENT00");

  Bench coarse("resolution=20 multiturn_bits=12", interface);  // the identity does not report the number of turn bits
  const RunResult turns = coarse.run("info");
  ASSERT_TRUE(turns.reading);
  EXPECT_EQ(turns.reading->multiturn_bits, 12u);
  EXPECT_EQ(turns.reading->multiturn, 7u);
}

TEST_P(EncolinkHost, StopsProcedureWhenIdentityContradictsOptions) {
  Bench bench("resolution=20 multiturn_bits=16", interface);
  bench.tell("multiturn_bits=0");
  EXPECT_EQ(bench.run("alarms").error, Error::unexpected_reply);
}

TEST_P(EncolinkHost, DoesNotBlameOptionsForUnknownIdentity) {
  Bench bench("resolution=20 multiturn_bits=16", interface);
  bench.tampered.replies([](unsigned, RawBytes& reply) {
    if (reply.size() < identity_bytes) return;
    reply[0] = 3;
    reply[identity_bytes - 1] = checksum(Bytes(reply).first(identity_bytes - 1));
  });
  const RunResult identify = bench.run("identify");
  EXPECT_EQ(identify.error, Error::unexpected_reply);
  EXPECT_FALSE(says(identify.detail, "resolution")) << identify.detail;
}

TEST_P(EncolinkHost, AcceptsByteAfterIdentity) {
  for (const std::string_view told : {std::string_view(""), testing::multi}) {
    Bench bench("resolution=20 multiturn_bits=16 identity_bytes=20", interface);
    bench.tell(told);
    for (int i = 0; i < 3; ++i) {
      const RunResult position = bench.run("position");
      ASSERT_TRUE(position.reading) << position.detail;
      EXPECT_EQ(position.reading->singleturn, 0x12345u);
      bench.pass(1ms);
    }
    EXPECT_EQ(bench.run("info").texts["serial_number"], "AK2A0001");
    bench.pass(1ms);
    EXPECT_EQ(bench.run("memory-write", {0x04, 5}).error, Error::none);
    EXPECT_EQ(bench.first_violation(), "");
  }
}

TEST_P(EncolinkHost, ReadsIdentityUpToThreeTimes) {
  for (const auto& [bad, error] :
       std::to_array<std::pair<unsigned, Error>>({{2, Error::none}, {3, Error::bad_checksum}})) {
    Bench bench("resolution=20 multiturn_bits=16", interface);
    unsigned left = bad;
    bench.tampered.replies([&](unsigned, RawBytes& reply) {
      if (reply.size() == identity_bytes && left > 0) --left, reply[3] ^= 0x01;
    });
    const RunResult identify = bench.run("identify");
    EXPECT_EQ(identify.error, error);
    EXPECT_EQ(identify.frames, 6u);
  }
}

TEST_P(EncolinkHost, AccessesNoRegistersOfVersion4) {
  Bench bench("resolution=20 multiturn_bits=16 protocol_version=4", interface);
  for (const std::string_view told : {std::string_view(""), testing::multi}) {
    bench.tell(told);
    EXPECT_EQ(bench.run("position").error, Error::none);
    EXPECT_EQ(bench.run("alarms").error, Error::none);
    for (const auto& [command, arguments] :
         std::vector<std::pair<std::string_view, std::vector<std::int64_t>>>{{"memory-read", {0x4C}},
                                                                             {"memory-write", {0x00, 5}},
                                                                             {"zero", {}},
                                                                             {"preset-multiturn", {}},
                                                                             {"save", {}},
                                                                             {"self-calibrate", {}}}) {
      const RunResult refused = bench.run(command, arguments);
      EXPECT_EQ(refused.error, Error::unsupported);
      EXPECT_EQ(refused.detail, not_described);
    }
    const RunResult info = bench.run("info");
    ASSERT_EQ(info.error, Error::none) << info.detail;
    EXPECT_EQ(info.numbers.at("protocol_version"), 4);
    EXPECT_EQ(info.texts.at("registers"), not_described);
    ASSERT_TRUE(info.reading);
    EXPECT_EQ(info.reading->singleturn, 0x12345u);
    EXPECT_EQ(info.texts.count("serial_number"), 0u);
  }
  EXPECT_EQ(bench.device.memory_version(), 0u);
  EXPECT_EQ(bench.encoder.offset(), 0u);
}

// ---- Channel 2

TEST_P(EncolinkHost, ReadsDetailedStatusInOneCycle) {
  constexpr std::uint16_t raised = status::temperature | status::multiturn_mismatch;
  for (const std::string_view settings : {testing::single, testing::multi}) {
    Bench bench(settings, interface);
    // the shaft turns, so each frame has another position; the cycle must carry that of its first frame
    bench.shaft.spin(3000, bench.line.now());
    bench.device.raise_alarms(raised);
    const RunResult read = bench.run("alarms");
    ASSERT_EQ(read.error, Error::none) << read.detail;
    EXPECT_EQ(read.numbers.at("status"), raised);
    EXPECT_EQ(read.numbers.at("alarms"), raised);
    EXPECT_EQ(read.frames, 1 + bench.encoder.format().cycle_bytes());
    EXPECT_EQ(read.reading->alarms, std::uint32_t{raised});
    EXPECT_FALSE(read.reading->multiturn_valid);
  }
}

TEST_P(EncolinkHost, ReadsAlarmsWhenStatusBitIsSet) {
  Bench bench(testing::single, interface);
  for (const auto& [alarm, general, valid] : std::to_array<std::tuple<std::uint16_t, std::uint32_t, bool>>(
           {{status::temperature, general::warning, true}, {status::signal_lost, general::error, false}})) {
    bench.device.lower_alarms(0xFFFF);
    bench.device.raise_alarms(alarm);
    const RunResult read = bench.run("position");
    ASSERT_TRUE(read.reading);
    EXPECT_EQ(read.reading->status, general);
    EXPECT_EQ(read.reading->alarms, std::uint32_t{alarm});
    EXPECT_EQ(read.reading->singleturn_valid(), valid);
    bench.pass(spi_pause);
  }
}

TEST_P(EncolinkHost, ReportsChannel2ThatDisagrees) {
  Bench bench(testing::multi, interface);
  bench.condition(condition_channels_disagree, 1);
  const RunResult status = bench.run("alarms");
  EXPECT_EQ(status.error, Error::cross_check_failed);
  EXPECT_TRUE(says(status.detail, "channel 2 has another position")) << status.detail;
  bench.pass(spi_pause);
  // single positions can still be read although channel 2 is wrong
  EXPECT_EQ(bench.run("position").error, Error::none);
  const RunResult read = bench.run("memory-read", {0x4C});
  EXPECT_EQ(read.error, Error::cross_check_failed);
  EXPECT_TRUE(says(read.detail, "channel 2 has another position")) << read.detail;
  EXPECT_GT(read.emits, 20u);
}

// The sequence of frames: frame 0 resets the channels, the cycle of channel 2 begins in frame 1.
TEST_P(EncolinkHost, RepeatsInvalidCycle) {
  // changes the turns in the first frame of the cycle, so that channel 2 contradicts channel 1
  const auto turned = [](unsigned frame, RawBytes& reply) {
    if (frame % 10 != 1) return;
    ++reply[1];
    reply[5] = checksum(Bytes(reply).first(5));
  };
  const auto damaged = [](unsigned, RawBytes& reply) { reply[6] ^= 0x01; };
  const auto at = [](unsigned nth, std::size_t byte) {
    return [=](unsigned frame, RawBytes& reply) { reply[byte] ^= frame == nth ? 0x01 : 0; };
  };
  struct Case {
    author::testing::Tamper tamper;
    Error error;
    unsigned frames;
  };
  for (const Case& one : std::vector<Case>{{at(4, 6), Error::none, 2 * 10},      // this row damages one channel 2 byte
                                           {at(3, 0), Error::none, 3 + 1 + 10},  // this row damages one position frame
                                           {turned, Error::cross_check_failed, 3 * 10},
                                           {damaged, Error::bad_checksum, 3 * 10}}) {
    Bench bench(testing::multi, interface);
    bench.tampered.replies(one.tamper);
    const RunResult read = bench.run("alarms");
    EXPECT_EQ(read.error, one.error);
    EXPECT_EQ(read.frames, one.frames);
  }
}

TEST_P(EncolinkHost, ZerosWithoutChannel2AreNotReady) {
  Bench bench(testing::single, interface);
  bench.restart(PowerOn::real);
  bench.line.wake(0);
  const RunResult early = bench.run("position");
  ASSERT_TRUE(early.reading);  // a starting encoder sends zeros, which are a well-formed position
  EXPECT_FALSE(early.reading->ready);
  bench.pass(start_up);
  bench.shaft.put(0, 0);
  const RunResult late = bench.run("position");
  ASSERT_TRUE(late.reading);
  EXPECT_TRUE(late.reading->ready);
}

// The shaft is at position zero and channel 2 is wrong: the host must not take the encoder for one that is starting.
TEST_P(EncolinkHost, ZerosWithWrongChannel2AreReady) {
  const auto damaged = [](unsigned, RawBytes& reply) { reply.back() ^= 0x01; };
  const auto none = [](unsigned, RawBytes&) {};
  for (const bool disagrees : {false, true}) {
    Bench bench(testing::single, interface);
    bench.shaft.put(0, 0);
    bench.condition(condition_channels_disagree, disagrees ? 1 : 0);
    bench.tampered.replies(disagrees ? author::testing::Tamper(none) : author::testing::Tamper(damaged));
    const RunResult read = bench.run("position");
    ASSERT_TRUE(read.reading) << read.detail;
    EXPECT_TRUE(read.reading->ready) << disagrees;
    bench.pass(spi_pause);
    EXPECT_EQ(bench.run("alarms").error, disagrees ? Error::cross_check_failed : Error::bad_checksum);
  }
}

// At 10 000 rpm a position of 20 bits advances by about 175 counts per microsecond.
TEST_P(EncolinkHost, LatchedIsTimeOfPosition) {
  for (const std::string_view told : {testing::multi, std::string_view("")}) {
    Bench bench(testing::multi, interface);
    bench.tell(told);
    bench.shaft.spin(10'000, bench.line.now());
    for (int i = 0; i < 3; ++i) {
      const RunResult read = bench.run("position");
      ASSERT_TRUE(read.reading) << read.detail;
      EXPECT_EQ(read.reading->singleturn, bench.encoder.measure(read.reading->latched).singleturn);
      bench.pass(1ms);
    }
  }
}

TEST_P(EncolinkHost, ReadsOnlyPositionsWithoutChannel2) {
  Bench bench("resolution=20 multiturn_bits=0 has_ch2=false", interface);
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x12345u);
  for (const auto& [command, arguments] : std::vector<std::pair<std::string_view, std::vector<std::int64_t>>>{
           {"alarms", {}}, {"memory-read", {0x4C}}, {"save", {}}}) {
    EXPECT_EQ(bench.run(command, arguments).error, Error::unsupported);
  }
  bench.pass(spi_pause);
  const RunResult info = bench.run("info");
  EXPECT_EQ(info.error, Error::none);
  EXPECT_EQ(info.numbers.count("firmware_major"), 0u);
}

}  // namespace
}  // namespace absenc::encolink
