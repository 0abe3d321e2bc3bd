// SPDX-License-Identifier: Apache-2.0
// A million random readings over a line with faults: what is accepted passes the checks that were asked for, nothing
// hangs, and the host breaks no rule. SSI has no checksum: only reading twice finds damage.
#include <gtest/gtest.h>

#include <cstdio>

#include "absenc/protocol/biss/bench_test.hpp"
#include "absenc/protocol/ssi/device.hpp"
#include "absenc/protocol/ssi/host.hpp"
#include "absenc/sim/faults.hpp"

namespace absenc::ssi {
namespace {

struct Tally {
  std::uint64_t accepted = 0;
  std::uint64_t wrong = 0;
};

// Both halves alike, or nothing behind the word: written down once more.
bool looks_right(const Format& format, Bytes received) {
  const BitView bits{received, clocks(format)};
  for (std::size_t i = format.word.bits(); i < bits.size; ++i) {
    if (bits[i] != bits[i - format.word.bits()]) return false;
  }
  return true;
}

Tally campaign(const Format& format, std::uint64_t seed) {
  using sim::FaultKind;
  constexpr std::uint64_t readings = 250'000;
  sim::FaultRates rates;
  for (const FaultKind kind : {FaultKind::drop, FaultKind::truncate, FaultKind::garbage, FaultKind::silence}) {
    rates[kind] = 0.02;
  }
  rates[FaultKind::corrupt] = 0.1;
  sim::Random random(seed);
  biss::testing::TestShaft shaft;
  VirtualEncoder encoder(format, shaft);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  sim::FaultyDevice faulty(encoder, rates, seed);
  sim::Line<std::uint8_t> line(LinkKind::clocked, line_settings);
  line.attach(sim::Role::device, faulty);
  std::size_t host = ~std::size_t{0};
  Tally tally;
  for (std::uint64_t i = 0; i < readings && !::testing::Test::HasFailure(); ++i) {
    shaft.state.position = static_cast<std::int64_t>(random.next());
    ReadPosition read(format);
    if (i == 0) {
      host = line.attach(sim::Role::host, read);
    } else {
      line.replace(host, read);
    }
    EXPECT_TRUE(line.run(host, line.now() + 1s)) << "hangs";
    if (read.error() != Error::none) continue;
    ++tally.accepted;
    // A line that nobody drives is a word of ones twice: the error bit makes it invalid.
    if (read.reading()->singleturn_valid() && !(read.word() == encoder.word(line.now()))) ++tally.wrong;
    EXPECT_TRUE(looks_right(format, read.exchange().received));
  }
  EXPECT_EQ(encoder.violation_count(), 0u) << encoder.violations()[0].rule;
  std::printf("%llu readings, %llu damaged, %llu accepted, %llu of them wrong\n",
              static_cast<unsigned long long>(readings), static_cast<unsigned long long>(faulty.damaged_replies()),
              static_cast<unsigned long long>(tally.accepted), static_cast<unsigned long long>(tally.wrong));
  EXPECT_GT(faulty.damaged_replies(), readings / 10);
  EXPECT_GT(tally.accepted, readings / 2);
  return tally;
}

const WordFormat turns = "multiturn:12 position:13 error:1 gray"_word;

class SsiExchange : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(SsiExchange, QuarterOfAMillionReadTwice) {
  EXPECT_LT(campaign({.word = turns, .extra_clocks = turns.bits()}, GetParam()).wrong, 250u);  // of 42 000 damaged
}

INSTANTIATE_TEST_SUITE_P(Seeds, SsiExchange, ::testing::Values(1, 2, 3));

TEST(SsiExchangeOnce, QuarterOfAMillionReadOnce) {
  EXPECT_GT(campaign({.word = turns}, 4).wrong, 10'000u);  // why reading twice is worth its clocks
}

}  // namespace
}  // namespace absenc::ssi
