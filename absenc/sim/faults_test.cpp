// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/faults.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "absenc/sim/line.hpp"

namespace absenc::sim {
namespace {

using std::chrono::microseconds;
using ByteVector = std::vector<std::uint8_t>;
using Kind = Event<std::uint8_t>::Kind;
using StepKind = Step<std::uint8_t>::Kind;

const ByteVector request{0x32, 0x05};
const ByteVector reply{0x11, 0x22, 0x33, 0x44};

// A device that answers every two bytes 3 us later, and counts violations: events that a port must not report to it.
class Device final : public Machine<std::uint8_t> {
 public:
  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Kind::sent) sending = false;
    if (event.kind == Kind::timer) ++timers;
    // Counts a violation by the port: a `silence` during a transfer.
    if (event.kind == Kind::silence && sending) ++violations;
    if (event.kind != Kind::received) return;
    if (sending) ++violations;
    received.insert(received.end(), event.items.begin(), event.items.end());
    if (sending || received.size() % 2 != 0) return;
    pending_ = sending = true;
    at_ = event.at + microseconds(3);
  }
  Step<std::uint8_t> next(Time) override {
    if (!pending_) return {.at = timer_at, .gap = gap};
    pending_ = false;
    out_ = reply;
    return {.kind = StepKind::transfer, .out = out_, .at = at_};
  }
  bool sending = false;
  int violations = 0;
  int timers = 0;
  Time timer_at{};
  Time gap = microseconds(2);
  ByteVector received;

 private:
  bool pending_ = false;
  Time at_{};
  ByteVector out_;
};

class Host final : public Machine<std::uint8_t> {
 public:
  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Kind::received && received.empty()) first_at = event.at;
    received.insert(received.end(), event.items.begin(), event.items.end());
  }
  Step<std::uint8_t> next(Time) override {
    if (!send_now) return {};
    send_now = false;
    return {.kind = StepKind::transfer, .out = request_bytes};
  }
  ByteVector request_bytes = request;
  bool send_now = false;
  ByteVector received;
  Time first_at{};
};

// At 1 Mbps a character of 10 bits takes 10 us.
struct Faults : testing::Test {
  Device device;
  Host host;
  Line<std::uint8_t> line{LinkKind::half_duplex, {.rate = 1'000'000}};
  std::unique_ptr<FaultyDevice> faulty;
  Line<std::uint8_t>::Node node = 0;

  void damage(FaultKind kind, double rate = 1, std::uint64_t seed = 1) {
    FaultRates rates;
    rates[kind] = rate;
    faulty = std::make_unique<FaultyDevice>(device, rates, seed);
    line.attach(NodeRole::device, *faulty);
    node = line.attach(NodeRole::host, host);
  }
  // Sends one request and returns the bytes received within 1 ms.
  ByteVector exchange() {
    host.received.clear();
    host.send_now = true;
    line.wake(node);
    line.run_until(line.now() + microseconds(1000));
    return host.received;
  }
};

int different_bits(const ByteVector& a, const ByteVector& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += std::popcount(static_cast<unsigned>(a[i] ^ b[i]));
  return count;
}

TEST_F(Faults, WithoutFaultsRepliesAreUnchanged) {
  damage(FaultKind::drop, 0);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(exchange(), reply);
  EXPECT_EQ(host.first_at % microseconds(1000), microseconds(33));
  EXPECT_EQ(faulty->damaged_replies(), 0u);
}

TEST_F(Faults, DropLosesOneByte) {
  damage(FaultKind::drop);
  bool first_lost = false;
  bool last_lost = false;
  for (int i = 0; i < 50; ++i) {
    const ByteVector damaged = exchange();
    EXPECT_EQ(damaged.size(), 3u);
    first_lost = first_lost || damaged.front() != reply.front();
    last_lost = last_lost || damaged.back() != reply.back();
  }
  EXPECT_TRUE(first_lost && last_lost);
  EXPECT_EQ(faulty->count(FaultKind::drop), 50u);
  EXPECT_EQ(faulty->damaged_replies(), 50u);
}

TEST_F(Faults, CorruptFlipsOneToThreeBits) {
  damage(FaultKind::corrupt);
  std::array<int, 4> seen{};
  for (int i = 0; i < 100; ++i) {
    const ByteVector damaged = exchange();
    ASSERT_EQ(damaged.size(), reply.size());
    ++seen.at(static_cast<std::size_t>(different_bits(damaged, reply)));
  }
  EXPECT_EQ(seen[0], 0);
  for (int bits = 1; bits <= 3; ++bits) EXPECT_GT(seen.at(static_cast<std::size_t>(bits)), 15);
}

TEST_F(Faults, TruncateKeepsTheBeginning) {
  damage(FaultKind::truncate);
  std::array<int, 4> seen{};
  for (int i = 0; i < 50; ++i) {
    const ByteVector damaged = exchange();
    ASSERT_TRUE(!damaged.empty() && damaged.size() < reply.size());
    EXPECT_TRUE(std::equal(damaged.begin(), damaged.end(), reply.begin()));
    ++seen.at(damaged.size());
  }
  for (std::size_t size = 1; size < 4; ++size) EXPECT_GT(seen.at(size), 5);
}

TEST_F(Faults, DelayComesLate) {
  damage(FaultKind::delay);
  EXPECT_EQ(exchange(), reply);
  EXPECT_EQ(host.first_at, microseconds(20 + 3 + 200 + 10));
}

TEST_F(Faults, EchoAndRepeatLengthenTheReply) {
  damage(FaultKind::echo);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(exchange(), (ByteVector{0x32, 0x05, 0x11, 0x22, 0x33, 0x44}));
  FaultRates rates;
  rates[FaultKind::repeat] = 1;
  faulty->set_rates(rates);
  EXPECT_EQ(exchange(), (ByteVector{0x11, 0x22, 0x33, 0x44, 0x11, 0x22, 0x33, 0x44}));
}

TEST_F(Faults, GarbageComesBeforeTheReply) {
  damage(FaultKind::garbage);
  std::array<int, 5> seen{};
  for (int i = 0; i < 50; ++i) {
    const ByteVector damaged = exchange();
    ASSERT_TRUE(damaged.size() > 4 && damaged.size() <= 8);
    EXPECT_TRUE(std::equal(reply.begin(), reply.end(), damaged.end() - 4));
    ++seen.at(damaged.size() - 4);
  }
  for (std::size_t size = 1; size <= 4; ++size) EXPECT_GT(seen.at(size), 3);
}

TEST_F(Faults, WholeCharactersOfTwoBytesAreLostOrAdded) {
  const auto damaged_by = [&](FaultKind kind) {
    FaultRates rates;
    rates.character_bytes = 2;
    rates[kind] = 1;
    faulty->set_rates(rates);
    return exchange();
  };
  damage(FaultKind::drop);
  bool first_lost = false;
  bool last_lost = false;
  for (int i = 0; i < 20; ++i) {
    const ByteVector damaged = damaged_by(FaultKind::drop);
    first_lost = first_lost || damaged == ByteVector{0x33, 0x44};
    last_lost = last_lost || damaged == ByteVector{0x11, 0x22};
    EXPECT_EQ(damaged.size(), 2u);
    EXPECT_EQ(damaged_by(FaultKind::truncate), (ByteVector{0x11, 0x22}));
    const ByteVector longer = damaged_by(FaultKind::garbage);
    EXPECT_TRUE(longer.size() % 2 == 0 && longer.size() > 4 && longer.size() <= 12) << longer.size();
  }
  EXPECT_TRUE(first_lost && last_lost);
}

TEST_F(Faults, DeviceContinuesAfterSuppressedReply) {
  damage(FaultKind::silence);
  device.timer_at = microseconds(500);  // the device must get its `timer` event although its reply was suppressed
  EXPECT_TRUE(exchange().empty());
  EXPECT_FALSE(device.sending);
  EXPECT_EQ(device.timers, 1);
  EXPECT_EQ(device.violations, 0);
  faulty->set_rates({});
  EXPECT_EQ(exchange(), reply);
  EXPECT_EQ(faulty->damaged_replies(), 1u);
}

TEST_F(Faults, RequestCorruptReachesTheDeviceOnly) {
  damage(FaultKind::request_corrupt);
  EXPECT_EQ(exchange(), reply);
  const int bits = different_bits(device.received, request);
  EXPECT_TRUE(bits >= 2 && bits <= 6) << bits;
  EXPECT_EQ(faulty->count(FaultKind::request_corrupt), 2u);
}

// The host may send its next request before a delayed or repeated reply has ended.
TEST_F(Faults, StretchedReplyCausesNoViolation) {
  damage(FaultKind::delay);
  for (const FaultKind kind : {FaultKind::delay, FaultKind::repeat}) {
    FaultRates rates;
    rates[kind] = 1;
    faulty->set_rates(rates);
    for (const int again_after : {150, 70}) {
      host.send_now = true;
      line.wake(node);
      line.run_until(line.now() + microseconds(again_after));
      host.send_now = true;
      line.wake(node);
      line.run_until(line.now() + microseconds(1000));
      EXPECT_FALSE(device.sending);
    }
  }
  EXPECT_EQ(device.violations, 0);
}

// The device takes the first half of a damaged request for a whole request, and answers too early.
TEST_F(Faults, DamagedRequestCausesNoViolation) {
  damage(FaultKind::request_corrupt);
  host.request_bytes = {1, 2, 3, 4};
  (void)exchange();
  EXPECT_EQ(device.received.size(), 2u);
  EXPECT_EQ(device.violations, 0);
  EXPECT_FALSE(device.sending);
}

// The host's second request, at 90 us, begins before the repeated reply to the first request ends, at 103 us.
TEST_F(Faults, RequestWithIgnoredBeginningIsIgnored) {
  damage(FaultKind::repeat);
  device.gap = microseconds(15);
  for (const int begin : {0, 90}) {
    line.run_until(microseconds(begin));
    host.send_now = true;
    line.wake(node);
  }
  line.run_until(microseconds(1000));
  EXPECT_EQ(device.received.size(), 2u);
  EXPECT_EQ(exchange().size(), 8u);  // the device answers the request that follows the ignored request
}

TEST_F(Faults, EarlyRequestIsAViolation) {
  damage(FaultKind::corrupt);
  host.send_now = true;
  line.wake(node);
  line.run_until(microseconds(40));  // at 40 us the reply has begun, so a request now is too early
  host.send_now = true;
  line.wake(node);
  line.run_until(microseconds(1000));
  EXPECT_GT(device.violations, 0);
}

TEST(FaultSeed, DeterminesTheFaults) {
  const auto run = [](std::uint64_t seed) {
    Device device;
    FaultRates rates;
    for (double& rate : rates.rates) rate = 0.3;
    FaultyDevice faulty(device, rates, seed);
    ByteVector all;
    for (int i = 0; i < 50; ++i) {
      const Time now = microseconds(100 * i);
      faulty.feed({.kind = Kind::received, .at = now, .items = request});
      for (auto step = faulty.next(now); step.kind != StepKind::wait; step = faulty.next(now)) {
        all.insert(all.end(), step.out.begin(), step.out.end());
      }
      faulty.feed({.kind = Kind::sent, .at = now});
      faulty.feed({.kind = Kind::timer, .at = now + microseconds(50)});
    }
    return all;
  };
  EXPECT_EQ(run(5), run(5));
  EXPECT_NE(run(5), run(6));
}

TEST(ParseFault, KindsAndRates) {
  for (std::size_t i = 0; i < fault_names.size(); ++i) {
    const FaultRate parsed = parse_fault(std::string(fault_names[i]) + "=0.25");
    EXPECT_EQ(parsed.kind, static_cast<FaultKind>(i));
    EXPECT_EQ(parsed.rate, 0.25);
  }
  EXPECT_EQ(parse_fault("drop=1").rate, 1.0);
}

TEST(ParseFault, ErrorNamesTheProblem) {
  const auto refusal = [](const char* text) -> std::string {
    try {
      (void)parse_fault(text);
    } catch (const std::invalid_argument& problem) {
      return problem.what();
    }
    return "no exception";
  };
  EXPECT_EQ(refusal("gremlins=0.1"),
            "fault `gremlins=0.1`: unknown kind; known are drop, corrupt, truncate, delay, echo, garbage, silence, "
            "repeat, request_corrupt; for example `drop=0.01`");
  for (const char* text : {"drop", "drop=", "drop=1.5", "drop=-0.1", "drop=nan", "drop=0.1x"}) {
    EXPECT_EQ(refusal(text),
              "fault `" + std::string(text) + "`: the rate must be a number from 0 to 1, for example `drop=0.01`");
  }
}

}  // namespace
}  // namespace absenc::sim
