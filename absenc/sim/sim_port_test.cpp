// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/sim_port.hpp"

#include <gtest/gtest.h>

#include <array>
#include <stdexcept>
#include <vector>

#include "absenc/host/drive.hpp"

namespace absenc::sim {
namespace {

using std::chrono::microseconds;
using Kind = Event<std::uint8_t>::Kind;
using StepKind = Step<std::uint8_t>::Kind;

// A device that answers each byte with the same byte and its successor 3 us later.
class Responder final : public Machine<std::uint8_t> {
 public:
  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind != Kind::received) return;
    reply_ = {event.items[0], static_cast<std::uint8_t>(event.items[0] + 1)};
    at_ = event.at + microseconds(3);
    pending_ = true;
  }
  Step<std::uint8_t> next(Time) override {
    if (!pending_) return {};
    pending_ = false;
    return {.kind = StepKind::transfer, .out = reply_, .at = at_};
  }

 private:
  std::array<std::uint8_t, 2> reply_{};
  Time at_{};
  bool pending_ = false;
};

// A host that sends a number of requests, at least 100 us apart, and emits after each.
class Requester final : public Machine<std::uint8_t> {
 public:
  explicit Requester(int times) : left_(times) {}
  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Kind::received) received_ += event.items.size();
    if (event.kind == Kind::sent) sent_at = event.at;
    last = event;
    if (received_ == 2 || event.kind == Kind::silence) result_ = true;
  }
  Step<std::uint8_t> next(Time now) override {
    if (result_) {
      result_ = false;
      received_ = 0;
      --left_;
      due_ = true;
      return {.kind = StepKind::emit};
    }
    if (left_ == 0) return {.kind = StepKind::done};
    if (!due_) return {.answer = microseconds(50), .gap = microseconds(20)};
    due_ = false;
    requested_at_ = std::max(now, requested_at_ + microseconds(100));
    return {.kind = StepKind::transfer, .out = request_, .at = requested_at_};
  }
  Event<std::uint8_t> last{};
  Time sent_at{};

 private:
  static constexpr std::array<std::uint8_t, 1> request_{0x41};
  int left_;
  std::size_t received_ = 0;
  bool result_ = false;
  bool due_ = true;
  Time requested_at_ = -microseconds(100);
};

constexpr LineSettings settings{.rate = 1'000'000};  // a character of 10 bits takes 10 us

TEST(SimPort, VirtualTimeJumpsAndIsExact) {
  Responder device;
  SimPort<std::uint8_t> port(LinkKind::half_duplex, settings, device);
  Requester requester(3);
  std::vector<std::int64_t> times;
  EXPECT_TRUE(host::drive(requester, port, [&] {
    times.push_back(requester.last.at.count());
    return true;
  }));
  EXPECT_EQ(times, (std::vector<std::int64_t>{33'000, 133'000, 233'000}));
}

class Mute final : public Machine<std::uint8_t> {
  void feed(const Event<std::uint8_t>&) override {}
  Step<std::uint8_t> next(Time) override { return {}; }
};

TEST(SimPort, SilenceAndTimers) {
  Mute mute;
  SimPort<std::uint8_t> port(LinkKind::half_duplex, settings, mute);
  EXPECT_THROW((void)port.wait({}), std::logic_error);
  const std::array<std::uint8_t, 2> out{1, 2};
  port.begin({.kind = StepKind::transfer, .out = out, .at = microseconds(5)});
  const Step<std::uint8_t> patient{.at = microseconds(40), .answer = microseconds(50)};
  const auto expect = [&](Kind kind, Time at) {
    const Event<std::uint8_t> event = port.wait(patient);
    EXPECT_EQ(event.kind, kind);
    EXPECT_EQ(event.at, at);
    EXPECT_EQ(port.now(), at);
  };
  expect(Kind::sent, microseconds(25));
  expect(Kind::timer, microseconds(40));
  expect(Kind::silence, microseconds(75));
}

TEST(SimPort, TransferWaitsForAbandonedOne) {
  Mute mute;
  SimPort<std::uint8_t> port(LinkKind::half_duplex, settings, mute);
  const std::array<std::uint8_t, 2> out{1, 2};
  port.begin({.kind = StepKind::transfer, .out = out, .at = microseconds(5)});
  port.begin({.kind = StepKind::transfer, .out = std::span(out).first(1)});
  const Event<std::uint8_t> event = port.wait({.at = microseconds(100)});
  EXPECT_EQ(event.kind, Kind::sent);
  EXPECT_EQ(event.at, microseconds(35));
}

TEST(SimPort, ConfigureChangesTheHostsEnd) {
  Responder device;
  SimPort<std::uint8_t> port(LinkKind::half_duplex, settings, device);
  port.begin({.kind = StepKind::configure, .rate = 2'000'000});
  const std::array<std::uint8_t, 1> out{1};
  port.begin({.kind = StepKind::transfer, .out = out});
  EXPECT_EQ(port.wait({}).at, microseconds(5));
}

// A clock that advances by 7 us each time it is read, and sleeps 30 us too long.
struct SlowWorld {
  Time clock = std::chrono::seconds(1000);
  int sleeps = 0;
  RealTime real_time() {
    return {[this] { return clock += microseconds(7); },
            [this](Time until) {
              ++sleeps;
              clock = std::max(clock, until + microseconds(30));
            }};
  }
};

TEST(SimPort, KeepsPaceWithRealTimeAndStampsExactly) {
  SlowWorld world;
  Responder device;
  SimPort<std::uint8_t> port(LinkKind::half_duplex, settings, device, world.real_time());
  Requester requester(50);
  std::vector<Time> times;
  EXPECT_TRUE(host::drive(requester, port, [&] {
    // The caller of the port is busy with something else for 5 ms.
    if (times.size() == 10) world.clock += microseconds(5000);
    EXPECT_EQ(requester.last.kind, Kind::received);
    EXPECT_EQ(requester.last.items.back(), 0x42);
    EXPECT_EQ(requester.last.at - requester.sent_at, microseconds(23));
    times.push_back(requester.last.at);
    return true;
  }));
  ASSERT_EQ(times.size(), 50u);
  EXPECT_LT(times[0], microseconds(200));
  EXPECT_GE(times[11] - times[10], microseconds(5000));
  EXPECT_GT(world.sleeps, 20);
  EXPECT_GE(world.clock - std::chrono::seconds(1000), times.back());
  EXPECT_LT(world.clock - std::chrono::seconds(1000) - times.back(), microseconds(150));
}

TEST(SimPort, LimitsRunOnlyDuringWaits) {
  SlowWorld world;
  Responder device;
  SimPort<std::uint8_t> port(LinkKind::half_duplex, settings, device, world.real_time());
  const std::array<std::uint8_t, 1> out{1};
  const Step<std::uint8_t> impatient{.answer = microseconds(50), .gap = microseconds(20)};
  for (int i = 0; i < 2; ++i) {
    port.begin({.kind = StepKind::transfer, .out = out});
    EXPECT_EQ(port.wait(impatient).kind, Kind::sent);
    EXPECT_EQ(port.wait(impatient).kind, Kind::received);
    EXPECT_EQ(port.wait(impatient).kind, Kind::received);
    world.clock += microseconds(1000);  // the caller is busy for 1 ms; limits of silence do not run in this time
    (void)port.now();
  }
  EXPECT_EQ(port.wait(impatient).kind, Kind::silence);
}

// The configure step advances the line to the present, which is later than the time of the timer that is requested
// next.
TEST(SimPort, ReportsTimerThatPassedMeanwhile) {
  SlowWorld world;
  Mute mute;
  SimPort<std::uint8_t> port(LinkKind::half_duplex, settings, mute, world.real_time());
  const Time start = port.now();
  world.clock += microseconds(1000);
  port.begin({.kind = StepKind::configure, .rate = 2'000'000});
  const Event<std::uint8_t> event = port.wait({.at = start + microseconds(5)});
  EXPECT_EQ(event.kind, Kind::timer);
  EXPECT_EQ(event.at, start + microseconds(5));
}

TEST(SimPort, InterruptedSleepLeavesThePortUsable) {
  Time clock{};
  bool interrupt = true;
  Responder device;
  SimPort<std::uint8_t> port(LinkKind::half_duplex, settings, device,
                             {[&] { return clock; },
                              [&](Time until) {
                                if (interrupt) throw std::runtime_error("interrupted");
                                clock = until;
                              }});
  const std::array<std::uint8_t, 1> out{1};
  port.begin({.kind = StepKind::transfer, .out = out});
  EXPECT_THROW((void)port.wait({}), std::runtime_error);
  interrupt = false;
  EXPECT_EQ(port.wait({}).kind, Kind::sent);
}

TEST(SimPort, NeedsBothFunctionsOrNone) {
  Responder device;
  EXPECT_THROW(SimPort<std::uint8_t>(LinkKind::half_duplex, settings, device, {[] { return Time{}; }, {}}),
               std::invalid_argument);
}

}  // namespace
}  // namespace absenc::sim
