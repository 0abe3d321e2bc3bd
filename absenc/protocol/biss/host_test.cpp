// SPDX-License-Identifier: Apache-2.0
// The host conversation against the virtual encoder in virtual time.
#include "absenc/protocol/biss/host.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "absenc/protocol/biss/bench_test.hpp"

namespace absenc::biss {
namespace {

using testing::Bench;
using testing::report;

const Format turns_19{.word = word_with_status({.position = 19, .multiturn = 16})};

TEST(BissHost, ReadsAtTheFirstFallingEdge) {
  Bench bench(line_settings, turns_19);
  bench.shaft.state.position = (std::int64_t{1} << 32) + (std::int64_t{275096} << 13);
  ReadPosition read(turns_19, {});
  bench.run(read);
  ASSERT_EQ(read.error(), Error::none);
  EXPECT_EQ(report(read), (std::map<std::string, std::int64_t>{{"ack_bits", 10},
                                                               {"multiturn", 1},
                                                               {"singleturn", 275096},
                                                               {"angle_deg", 188},
                                                               {"error", 0},
                                                               {"warning", 0},
                                                               {"crc", 0x1C}}));
  ASSERT_NE(read.reading(), nullptr);
  EXPECT_EQ(read.reading()->latched, 40us);
  EXPECT_EQ(read.reading()->received, 40us + (2 + 10 + 2 + 43) * 1us);
  EXPECT_TRUE(read.reading()->multiturn_valid);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(BissHost, AckFollowsTheClock) {
  for (const std::uint32_t rate : {100'000u, 1'000'000u, 4'400'000u, 10'000'000u}) {
    Bench bench(line_settings, turns_19);
    ReadPosition read(turns_19, {.rate = rate});
    ASSERT_EQ(bench.run(read).error(), Error::none) << rate;
    EXPECT_EQ(read.reply().ack_bits, ack_bits(10us, LineSettings{.rate = rate}.bits(1)));
    EXPECT_EQ(bench.encoder.violation_count(), 0u);
  }
}

TEST(BissHost, ReadingsKeepTheTimeout) {
  Bench bench(line_settings, turns_19, Behaviour{.timeout = timeout_maximum});
  for (int i = 0; i < 10; ++i) {
    ReadPosition read(turns_19, {});
    EXPECT_EQ(bench.run(read).error(), Error::none);
  }
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
  EXPECT_EQ(bench.encoder.answered(), 10u);
}

TEST(BissHost, ErrorBitMakesThePositionInvalid) {
  Bench bench(line_settings, turns_19);
  bench.encoder.raise_alarms(word_error | word_warning);
  ReadPosition read(turns_19, {});
  ASSERT_EQ(bench.run(read).error(), Error::none);
  EXPECT_FALSE(read.reading()->singleturn_valid());
  EXPECT_FALSE(read.reading()->multiturn_valid);
  EXPECT_EQ(read.reading()->alarms, word_error | word_warning);
  bench.encoder.lower_alarms(word_error);
  ReadPosition again(turns_19, {});
  EXPECT_TRUE(bench.run(again).reading()->singleturn_valid());
  EXPECT_EQ(again.reading()->alarms, word_warning);
}

TEST(BissHost, ALinearEncoderHasMicrometres) {
  const Format format{.word = word_with_status({.position = 26}), .scale = {true, 0.5}};
  Bench bench(line_settings, format);
  bench.shaft.state.position = std::int64_t{1000} << 6;
  ReadPosition read(format, {});
  ASSERT_EQ(bench.run(read).error(), Error::none);
  EXPECT_EQ(read.reading()->unit_um, 0.5);
  EXPECT_EQ(report(read)["position"], 1000);
  EXPECT_EQ(report(read)["position_um"], 500);
  EXPECT_FALSE(report(read).contains("singleturn"));
}

TEST(BissHost, WhatTheLineDoesWrong) {
  Bench slow(line_settings, turns_19, Behaviour{.latency = 12us});
  ReadPosition truncated(turns_19, {.latency = 10us});
  EXPECT_EQ(slow.run(truncated).error(), Error::truncated);
  EXPECT_NE(truncated.detail().find("ACK"), std::string_view::npos);
  EXPECT_EQ(slow.encoder.violation_count(), 1u);
  EXPECT_EQ(truncated.reading(), nullptr);
  EXPECT_TRUE(report(truncated).empty());

  Bench off(line_settings, turns_19);
  off.encoder.power_off(Time{});
  ReadPosition stuck(turns_19, {});
  EXPECT_EQ(off.run(stuck).error(), Error::line_stuck);

  ReadPosition impossible(turns_19, {.rate = 10'000'000, .latency = 1ms});
  EXPECT_EQ(impossible.next(Time{}).kind, Step<std::uint8_t>::Kind::done);
  EXPECT_EQ(impossible.error(), Error::invalid_argument);
}

/// Changes what an encoder sends.
class Tampered final : public Machine<std::uint8_t> {
 public:
  using Tamper = std::function<void(unsigned index, std::vector<std::uint8_t>& out)>;
  Tampered(VirtualEncoder& encoder, Tamper tamper) : encoder_(encoder), tamper_(std::move(tamper)) {}
  void feed(const Event<std::uint8_t>& event) override { encoder_.feed(event); }
  Step<std::uint8_t> next(Time now) override {
    Step<std::uint8_t> step = encoder_.next(now);
    if (step.kind != Step<std::uint8_t>::Kind::transfer) return step;
    out_.assign(step.out.begin(), step.out.end());
    tamper_(index_++, out_);
    step.out = out_;
    return step;
  }

 private:
  VirtualEncoder& encoder_;
  Tamper tamper_;
  unsigned index_ = 0;
  std::vector<std::uint8_t> out_;
};

const Format safety{.word = word_with_status({.position = 24}), .check = Check::crc16};

Error read_safety(const Tampered::Tamper& tamper) {
  testing::TestShaft shaft;
  VirtualEncoder encoder(safety, shaft);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  Tampered device(encoder, tamper);
  sim::Line<std::uint8_t> line(LinkKind::clocked, line_settings);
  line.attach(sim::Role::device, device);
  ReadPosition read(safety, {});
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, read)));
  EXPECT_EQ(encoder.violation_count(), 0u);
  EXPECT_EQ(read.reading() != nullptr, read.error() == Error::none);
  return read.error();
}

TEST(BissHost, SafetyNeedsALifeCounterThatMoves) {
  EXPECT_EQ(read_safety([](unsigned, auto&) {}), Error::none);
  std::vector<std::uint8_t> first;
  EXPECT_EQ(read_safety([&first](unsigned index, std::vector<std::uint8_t>& out) {
              if (index == 0) first = out;
              out = first;  // the same frame again
            }),
            Error::sequence_mismatch);
  EXPECT_EQ(read_safety([](unsigned index, std::vector<std::uint8_t>& out) {
              if (index == 1) out[3] ^= 0x10;
            }),
            Error::bad_checksum);
}

TEST(BissHost, LifeCounterGoesOnAtZero) {
  Bench bench(line_settings, safety);
  for (int i = 0; i < 70; ++i) {
    ReadPosition read(safety, {});
    ASSERT_EQ(bench.run(read).error(), Error::none) << i;
    EXPECT_EQ(read.reply().life_counter, (2 * i + 1) % 64);
  }
}

}  // namespace
}  // namespace absenc::biss
