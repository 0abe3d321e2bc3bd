// SPDX-License-Identifier: Apache-2.0
// Several virtual encoders on one line: polling, finding, silent, shouting and clashing ones.
#include "absenc/protocol/esl/bus.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>

#include "absenc/protocol/esl/bench_test.hpp"

namespace absenc::esl {
namespace {

using Wire = std::vector<std::uint8_t>;
using PowerOn = Device<std::uint8_t>::PowerOn;
using testing::report;

/// One encoder for each of `addresses`, each with its own shaft, and one host.
struct BusBench {
  explicit BusBench(std::vector<std::uint8_t> addresses, testing::Tampered::Tamper last_tamper = {}) {
    for (std::size_t i = 0; i < addresses.size(); ++i) {
      shafts.push_back(std::make_unique<testing::TestShaft>());
      shafts.back()->put(static_cast<std::int64_t>(i), static_cast<std::int64_t>(i) * 1'000'000 + 77);
      encoders.push_back(std::make_unique<VirtualEncoder>(Profile{.address = addresses[i], .bus = true}, *shafts[i]));
      encoders.back()->power_on(Time{}, PowerOn::skip);
      const bool last = i + 1 == addresses.size();
      devices.push_back(
          std::make_unique<testing::Tampered>(*encoders[i], last ? last_tamper : testing::Tampered::Tamper{}));
      line.attach(sim::Role::device, *devices[i]);
    }
  }
  template <class Conversation>
  Conversation& run(Conversation& conversation) {
    const auto host = line.attach(sim::Role::host, conversation);
    EXPECT_TRUE(line.run(host, line.now() + 10s));
    return conversation;
  }
  [[nodiscard]] std::uint32_t violations() const {
    std::uint32_t count = 0;
    for (const auto& encoder : encoders) count += encoder->violation_count();
    return count;
  }

  std::vector<std::unique_ptr<testing::TestShaft>> shafts;
  std::vector<std::unique_ptr<VirtualEncoder>> encoders;
  std::vector<std::unique_ptr<testing::Tampered>> devices;
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
};

const Profile on_a_bus{.bus = true};
const std::vector<std::uint8_t> all_addresses{0, 1, 2, 3, 4, 5, 6, 7};

TEST(EslBus, EightEncodersAsFastAsTheWireAllows) {
  constexpr std::uint64_t cycles = 10'000;
  BusBench bench(all_addresses);
  Poll poll(on_a_bus, all_addresses, DataId::position, cycles);
  bench.run(poll);
  ASSERT_EQ(poll.cycles(), cycles);
  for (std::size_t i = 0; i < 8; ++i) {
    const Polled& encoder = poll.encoders()[i];
    EXPECT_EQ(encoder.good, cycles);
    EXPECT_EQ(encoder.safe, cycles - 1);  // the first reply proves nothing
    EXPECT_EQ(encoder.reading.singleturn, i * 1'000'000 + 77);
    ASSERT_TRUE(encoder.position.has_value());
    EXPECT_EQ(encoder.position->encoder_address(), i);
    EXPECT_EQ(encoder.longest, answer_time + 18us);
  }
  EXPECT_EQ(bench.violations(), 0u);
  // Two bytes there, the answer time, eighteen bytes back, eight times: not even a bit of pause.
  const Time least = 8 * (2us + answer_time + 18us);
  const double share =
      static_cast<double>(cycles) * static_cast<double>(least.count()) / static_cast<double>(bench.line.now().count());
  std::printf("%.4f of the cycles the wire allows, %.0f cycles a second\n", share,
              static_cast<double>(cycles) * 1e9 / static_cast<double>(bench.line.now().count()));
  EXPECT_GE(share, 0.99);
}

TEST(EslBus, ASilentEncoderCostsItsOwnTurn) {
  BusBench bench(all_addresses);
  bench.encoders[3]->power_off(Time{});
  Poll poll(on_a_bus, all_addresses, DataId::position, 1000);
  bench.run(poll);
  for (std::size_t i = 0; i < 8; ++i) {
    const Polled& encoder = poll.encoders()[i];
    EXPECT_EQ(encoder.good, i == 3 ? 0u : 1000u);
    EXPECT_EQ(encoder.safe, i == 3 ? 0u : 999u);
    EXPECT_EQ(encoder.errors[static_cast<std::size_t>(Error::timeout)], i == 3 ? 1000u : 0u);
  }
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(EslBus, AShoutingEncoderCostsItsOwnTurn) {
  BusBench bench(all_addresses, [](unsigned, Wire& reply) { reply.insert(reply.begin(), 300, 0x55); });
  Poll poll(on_a_bus, all_addresses, DataId::position, 1000);
  bench.run(poll);
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(poll.encoders()[i].safe, 999u) << i;
  EXPECT_EQ(poll.encoders()[7].good, 0u);
  EXPECT_EQ(poll.encoders()[7].errors[static_cast<std::size_t>(Error::wrong_length)], 1000u);
  EXPECT_EQ(bench.violations(), 0u);
}

TEST(EslBus, AnEncoderThatComesBackIsTrustedAgainAfterTwoReplies) {
  BusBench bench({1, 2});
  const std::array<std::uint8_t, 2> list{1, 2};
  Poll poll(on_a_bus, list);
  unsigned cycle = 0;
  std::vector<bool> safe;
  const auto host = bench.line.attach(sim::Role::host, poll, [&] {
    safe.push_back(poll.encoders()[1].position.has_value());
    ++cycle;
    if (cycle == 4) bench.encoders[1]->power_off(bench.line.now());
    if (cycle == 6) bench.encoders[1]->power_on(bench.line.now(), PowerOn::skip);
    return cycle < 10;
  });
  bench.line.run(host, 1s);
  EXPECT_EQ(safe, (std::vector<bool>{false, true, true, true, false, false, false, true, true, true}));
}

TEST(EslBus, OtherIdsAndListsAreChecked) {
  BusBench bench({5});
  const std::array<std::uint8_t, 1> five{5};
  Poll quick(on_a_bus, five, DataId::singleturn_short, 3);
  bench.run(quick);
  EXPECT_EQ(quick.encoders()[0].good, 3u);
  EXPECT_EQ(quick.encoders()[0].safe, 0u);
  EXPECT_FALSE(quick.encoders()[0].position.has_value());
  EXPECT_EQ(Poll(on_a_bus, {}).error(), Error::invalid_argument);
  EXPECT_EQ(Poll(on_a_bus, five, DataId::encoder_id).error(), Error::invalid_argument);
}

TEST(EslBus, FindsWhoAnswers) {
  BusBench bench({1, 4, 6});
  Scan scan(on_a_bus);
  EXPECT_EQ(bench.run(scan).error(), Error::none);
  EXPECT_EQ(scan.answering(), 0b0101'0010);
  EXPECT_EQ(scan.disturbed(), 0);
  const auto fields = report(scan);  // of the last record
  EXPECT_EQ(fields.at("encoder_address"), 6);
  EXPECT_TRUE(fields.contains("singleturn"));
  EXPECT_EQ(fields.at("clash"), 0);
  EXPECT_EQ(bench.violations(), 0u);
  EXPECT_EQ(bench.encoders[0]->answered(), 1u);  // ID 5 and never ID 8
  BusBench nobody({});
  Scan empty(on_a_bus);
  EXPECT_EQ(nobody.run(empty).error(), Error::timeout);
}

TEST(EslBus, TwoEncodersWithOneAddressAreFound) {
  BusBench bench({1, 4, 4});
  Scan scan(on_a_bus);
  EXPECT_EQ(bench.run(scan).error(), Error::none);
  EXPECT_EQ(scan.answering(), 0b0000'0010);
  EXPECT_EQ(scan.disturbed(), 0b0001'0000);
  const std::array<std::uint8_t, 2> list{1, 4};
  Poll poll(on_a_bus, list, DataId::position, 100);
  bench.run(poll);
  EXPECT_EQ(poll.encoders()[0].safe, 99u);
  EXPECT_EQ(poll.encoders()[1].safe, 0u);
  EXPECT_EQ(poll.encoders()[1].good, 0u);
}

}  // namespace
}  // namespace absenc::esl
