// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/statistics.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace absenc::host {
namespace {

using namespace std::chrono_literals;

TEST(Latencies, AreExactWhileShort) {
  Latencies latencies;
  EXPECT_EQ(latencies.percentile(0.5), 0ns);
  for (int i = 0; i < 64; ++i) latencies.add(Time(i));
  EXPECT_EQ(latencies.percentile(0), 0ns);
  EXPECT_EQ(latencies.percentile(0.5), 32ns);
  EXPECT_EQ(latencies.percentile(1), 63ns);
  EXPECT_EQ(latencies.count(), 64u);
}

TEST(Latencies, AreAtMostA32ndTooLong) {
  for (std::int64_t value = 1; value < 68'000'000'000; value += value / 7 + 1) {
    Latencies latencies;
    latencies.add(Time(value));
    latencies.add(70s);  // a longer latency must follow, because the longest latency is stored exactly
    const std::int64_t told = latencies.percentile(0).count();
    ASSERT_GE(told, value);
    ASSERT_LE(told, value + value / 32);
  }
}

TEST(Latencies, LongestIsExact) {
  Latencies latencies;
  latencies.add(123'456'789ns);
  latencies.add(-1ns);
  latencies.add(1000s);
  EXPECT_EQ(latencies.percentile(0), 0ns);
  EXPECT_EQ(latencies.percentile(0.99), std::min<Time>(1000s, Time((std::int64_t{1} << 36) - 1)));
  EXPECT_EQ(latencies.longest(), 1000s);
}

TEST(Latencies, AreCountedWithinLimits) {
  constexpr std::array<Time, 4> limits{10us, 20us, 1ms, 1s};
  Latencies latencies;
  EXPECT_EQ(latencies.within(limits), (std::array<std::uint64_t, 4>{}));
  for (const Time latency : {Time(9us), Time(10'400ns), Time(15us), Time(999'900ns), Time(1001us), Time(2s)}) {
    latencies.add(latency);
  }
  // 999.9 us is within 1/32 below the limit of 1 ms, so it is counted only at the next limit.
  EXPECT_EQ(latencies.within(limits), (std::array<std::uint64_t, 4>{1, 3, 3, 5}));
  EXPECT_EQ(latencies.sum(), 2s + 2'035'300ns);
}

TEST(Latencies, AreNeverCountedWithinLimitsTheyExceed) {
  for (std::int64_t value = 1; value < 68'000'000'000; value += value / 7 + 1) {
    Latencies latencies;
    latencies.add(Time(value));
    ASSERT_EQ(latencies.within(std::array{Time(value - 1), Time(value + value / 32)}),
              (std::array<std::uint64_t, 2>{0, 1}));
  }
}

TEST(Rate, CountsTheLastSeconds) {
  Rate rate;
  EXPECT_EQ(rate.per_second(0s), 0);
  Time at{};
  rate.add(at);
  EXPECT_EQ(rate.per_second(at), 0);
  for (int i = 0; i < 1000; ++i) rate.add(at += 10ms);
  EXPECT_NEAR(rate.per_second(at + 5ms), 100, 1e-6);
  for (int i = 0; i < 10'000; ++i) rate.add(at += 1ms);
  EXPECT_NEAR(rate.per_second(at), 1000, 1);
}

TEST(Rate, FallsWithoutEvents) {
  Rate rate;
  for (int i = 0; i <= 100; ++i) rate.add(i * 100ms);
  EXPECT_NEAR(rate.per_second(10s + 100ms), 10, 0.1);
  EXPECT_LT(rate.per_second(11s), 6);
  EXPECT_LT(rate.per_second(20s), 1);
  EXPECT_LT(rate.per_second(1000s), 0.01);
}

/// A conversation that has ended with the result that a test sets.
struct Ended final : Conversation<std::uint8_t> {
  void feed(const Event<std::uint8_t>&) override {}
  Step<std::uint8_t> next(Time) override { return {.kind = Step<std::uint8_t>::Kind::done}; }
  [[nodiscard]] Error error() const override { return error_; }
  void report(FieldSink&) const override {}
  [[nodiscard]] Exchange<std::uint8_t> exchange() const override { return {sent, received, sent_at, received_at}; }

  Error error_ = Error::none;
  std::vector<std::uint8_t> sent{0x1A};
  std::vector<std::uint8_t> received{};
  Time sent_at{};
  Time received_at{};
};

TEST(Statistics, KeepTheLastBadExchanges) {
  Statistics<std::uint8_t> statistics;
  Ended ended;
  EXPECT_EQ(statistics.kept(), 0u);
  ended.error_ = Error::bad_checksum;
  for (int i = 1; i <= 10; ++i) {
    ended.received.assign(static_cast<std::size_t>(i), static_cast<std::uint8_t>(i));
    ended.received_at = i * 1s;
    statistics.add(ended);
  }
  ended.error_ = Error::none;
  statistics.add(ended);
  ASSERT_EQ(statistics.kept(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    const BadExchange<std::uint8_t>& bad = statistics.bad(i);
    EXPECT_EQ(bad.error, Error::bad_checksum);
    EXPECT_EQ(bad.at, (10 - static_cast<int>(i)) * 1s);
    EXPECT_EQ(bad.sent.size(), 1u);
    ASSERT_EQ(bad.received.size(), 10 - i);
    EXPECT_EQ(bad.received[0], 10 - i);
  }
}

TEST(Statistics, CutsLongExchanges) {
  Statistics<std::uint8_t> statistics;
  Ended ended;
  ended.error_ = Error::wrong_length;
  ended.received.assign(200, 0x55);
  statistics.add(ended);
  EXPECT_EQ(statistics.bad(0).received.size(), 64u);
}

TEST(Statistics, CountsGoodConversations) {
  Statistics<std::uint8_t> statistics;
  Ended ended;
  for (int i = 0; i < 5; ++i) {
    ended.sent_at = i * 1s;
    ended.received_at = i * 1s + 90us;
    ended.error_ = i == 3 ? Error::timeout : Error::none;
    statistics.add(ended);
  }
  EXPECT_EQ(statistics.latencies().count(), 4u);
  EXPECT_EQ(statistics.latencies().longest(), 90us);
  EXPECT_EQ(statistics.kept(), 1u);
  // equal times of request and reply mean that the exchange had no request, so its latency is not counted
  ended.sent_at = ended.received_at;
  statistics.add(ended);
  EXPECT_EQ(statistics.latencies().count(), 4u);
}

}  // namespace
}  // namespace absenc::host
