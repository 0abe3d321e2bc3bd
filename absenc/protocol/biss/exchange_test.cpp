// SPDX-License-Identifier: Apache-2.0
// A million random readings over a line with faults: nothing wrong is accepted that the checks of a frame could have
// caught, nothing hangs, and the host breaks no rule.
#include <gtest/gtest.h>

#include <cstdio>

#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/sim/faults.hpp"

namespace absenc::biss {
namespace {

/// What a careful reader of the document checks, written down once more and bit by bit.
bool looks_right(const Format& format, BitView samples) {
  std::size_t at = 0;
  while (at < samples.size && samples[at]) ++at;
  while (at < samples.size && !samples[at]) ++at;
  at += 2;
  if (at + data_bits(format) > samples.size || samples[at - 1]) return false;
  const bool small = format.check == Check::crc6;
  const unsigned width = small ? 6 : 16;
  const std::uint32_t poly = small ? 0x43 : 0x190D9;
  std::uint32_t remainder = 0;
  for (std::size_t i = 0; i < data_bits(format); ++i) {
    const bool inverted = i >= data_bits(format) - width;
    remainder = remainder << 1 | (samples[at + i] != inverted ? 1u : 0u);
    if ((remainder >> width & 1) != 0) remainder ^= poly;
  }
  return remainder == 0;
}

struct Tally {
  std::uint64_t accepted = 0;
  std::uint64_t undetectable = 0;
};

void judge(const Format& format, const ReadPosition& read, const Word& truth, unsigned bits, Tally& tally) {
  if (read.error() != Error::none) return;
  ++tally.accepted;
  if (read.reply().word == truth) return;
  ++tally.undetectable;
  EXPECT_TRUE(looks_right(format, {read.exchange().received, bits}));
}

Tally campaign(const Format& format, std::uint64_t readings, std::uint64_t seed) {
  using sim::FaultKind;
  sim::FaultRates rates;
  for (const FaultKind kind : {FaultKind::drop, FaultKind::truncate, FaultKind::garbage, FaultKind::silence,
                               FaultKind::repeat, FaultKind::delay}) {
    rates[kind] = 0.02;
  }
  rates[FaultKind::corrupt] = 0.1;
  sim::Random random(seed);
  testing::TestShaft shaft;
  VirtualEncoder encoder(format, shaft);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  sim::FaultyDevice faulty(encoder, rates, seed);
  sim::Line<std::uint8_t> line(LinkKind::clocked, line_settings);
  line.attach(sim::Role::device, faulty);
  const Clocking clocking;
  const unsigned bits = clocks(format, clocking.latency, 1us);
  std::size_t host = ~std::size_t{0};
  Tally tally;
  for (std::uint64_t i = 0; i < readings && !::testing::Test::HasFailure(); ++i) {
    shaft.state.position = static_cast<std::int64_t>(random.next());
    ReadPosition read(format, clocking);
    if (i == 0) {
      host = line.attach(sim::Role::host, read);
    } else {
      line.replace(host, read);
    }
    EXPECT_TRUE(line.run(host, line.now() + 1s)) << "hangs";
    judge(format, read, encoder.encoder().word(line.now()), bits, tally);
  }
  EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
  std::printf("%llu readings, %llu frames damaged, %llu accepted, %llu of them wrong but beyond what the CRC can see\n",
              static_cast<unsigned long long>(readings), static_cast<unsigned long long>(faulty.damaged_replies()),
              static_cast<unsigned long long>(tally.accepted), static_cast<unsigned long long>(tally.undetectable));
  EXPECT_GT(faulty.damaged_replies(), readings / 6);
  return tally;
}

class BissExchange : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(BissExchange, QuarterOfAMillionWithDamagedFrames) {
  const Format format{.word = word_with_status({.position = 19, .multiturn = 16})};
  const Tally tally = campaign(format, 250'000, GetParam());
  EXPECT_GT(tally.accepted, 150'000u);
  EXPECT_GT(tally.undetectable, 10u);  // a CRC of 6 bits
}

INSTANTIATE_TEST_SUITE_P(Seeds, BissExchange, ::testing::Values(1, 2, 3, 4));

TEST(BissSafetyExchange, FiftyThousandWithDamagedFrames) {
  const Format format{.word = word_with_status({.position = 24}), .check = Check::crc16};
  const Tally tally = campaign(format, 50'000, 5);
  EXPECT_GT(tally.accepted, 20'000u);
  EXPECT_LT(tally.undetectable, 5u);
}

}  // namespace
}  // namespace absenc::biss
