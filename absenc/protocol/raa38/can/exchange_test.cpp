// SPDX-License-Identifier: Apache-2.0
// A million random conversations on a bus with faults: whatever is accepted was sent by the node within the encoder's
// range, settings end as they should or are told not to, nothing hangs, and the host breaks no rule.
#include <gtest/gtest.h>

#include <cstdio>

#include "absenc/host/guarded_host_test.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/raa38/can/bench_test.hpp"
#include "absenc/sim/faulty_node.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::raa38::can {
namespace {

using sim::FaultKind;

struct Campaign {
  explicit Campaign(std::uint64_t seed, const sim::FaultRates& rates)
      : random(seed), encoder({}, shaft, testing::silent), faulty(encoder, rates, seed) {
    encoder.power_on(Time{}, Device<CanFrame>::PowerOn::skip);
    line.attach(sim::Role::device, faulty);
    line.attach(sim::Role::device, other_encoder);
    other_encoder.power_on(Time{}, Device<CanFrame>::PowerOn::skip);
  }

  template <class Conversation>
  void read(Conversation& conversation) {
    ASSERT_TRUE(host.run(conversation, 10s)) << "hangs";
  }

  // What listens to everybody hears everything.
  template <class Conversation>
  void set(Conversation& conversation) {
    if (setter == none) {
      setter = line.attach(sim::Role::host, conversation);
    } else {
      line.replace(setter, conversation);
    }
    ASSERT_TRUE(line.run(setter, line.now() + 10s)) << "hangs";
  }

  static constexpr std::size_t none = ~std::size_t{0};

  sim::Random random;
  testing::TestShaft shaft;
  VirtualNode encoder;
  VirtualNode other_encoder{Format{.node = 0x21}, shaft, NodeSettings{.readings_per_s = 100}};
  sim::FaultyNode faulty;
  sim::Line<CanFrame> line{LinkKind::can, {.rate = 250'000}};
  host::testing::GuardedHost<CanFrame> host{*find_unit("raa38-can"), line};
  std::size_t setter = none;
};

class CanExchange : public ::testing::TestWithParam<std::uint64_t> {};

// Nothing that the host accepts may be wrong as long as frames are lost, cut, late, doubled or strange, but not
// changed: against that the checksum of CAN stands, which is not ours.
TEST_P(CanExchange, QuarterOfAMillionReadings) {
  sim::FaultRates rates;
  for (const FaultKind kind : {FaultKind::drop, FaultKind::truncate, FaultKind::delay, FaultKind::echo,
                               FaultKind::garbage, FaultKind::silence, FaultKind::repeat}) {
    rates[kind] = 0.03;
  }
  rates.delay = 60ms;
  Campaign campaign(GetParam(), rates);
  constexpr unsigned readings = 250'000;
  unsigned accepted = 0;
  unsigned wrong = 0;
  unsigned late = 0;
  std::uint32_t previous = 0;
  for (unsigned i = 0; i < readings && !HasFatalFailure(); ++i) {
    const auto counts = static_cast<std::uint32_t>((previous + 1 + campaign.random.below((1 << 14) - 1)) % (1 << 14));
    campaign.shaft.put(0, counts);
    Read read({}, Read::Way::ask);
    campaign.read(read);
    if (read.error() == Error::none) {
      ++accepted;
      const bool is_previous = read.reading()->singleturn == previous;
      if (is_previous) ++late;
      if (read.reading()->singleturn != counts && !is_previous) ++wrong;
    }
    previous = counts;
  }
  std::printf("%u readings, %llu damaged frames, %u accepted, %u late, %u wrong\n", readings,
              static_cast<unsigned long long>(campaign.faulty.damaged_frames()), accepted, late, wrong);
  EXPECT_GT(campaign.faulty.damaged_frames(), readings / 10);
  EXPECT_GT(accepted, readings / 2);
  EXPECT_EQ(late, 0u);
  EXPECT_EQ(wrong, 0u);
}

INSTANTIATE_TEST_SUITE_P(Seeds, CanExchange, ::testing::Values(1, 2, 3, 4));

// The answers of zero and direction look like positions; whatever happens to them, none is ever shown as one.
TEST(CanExchangeSettings, TenThousandSettings) {
  sim::FaultRates rates;
  for (const FaultKind kind :
       {FaultKind::drop, FaultKind::truncate, FaultKind::garbage, FaultKind::silence, FaultKind::repeat}) {
    rates[kind] = 0.02;
  }
  Campaign campaign(7, rates);
  unsigned good = 0;
  for (unsigned i = 0; i < 10'000 && !HasFatalFailure(); ++i) {
    const auto counts = 2000 + static_cast<std::uint32_t>(campaign.random.below(10'000));
    campaign.shaft.put(0, counts);
    if (i % 2 == 0) {
      Zero zero({});
      campaign.set(zero);
      if (zero.error() != Error::none) continue;
      EXPECT_LE(std::min(campaign.encoder.position(campaign.line.now()),
                         (1u << 14) - campaign.encoder.position(campaign.line.now())),
                16u);
    } else {
      const bool negative = !campaign.encoder.is_negative();
      SetDirection direction({}, negative);
      campaign.set(direction);
      if (direction.error() != Error::none) continue;
      EXPECT_EQ(campaign.encoder.is_negative(), negative);
    }
    ++good;
  }
  std::printf("%u of 10000 settings were made\n", good);
  EXPECT_GT(good, 5000u);
  EXPECT_EQ(campaign.encoder.violation_count(), 0u) << campaign.encoder.violations()[0].rule;
}

}  // namespace
}  // namespace absenc::raa38::can
