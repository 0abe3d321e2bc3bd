// SPDX-License-Identifier: Apache-2.0
// Tests of the engine and the device of clocked lines, with a toy protocol.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "absenc/protocol/author/clocked_device.hpp"
#include "absenc/protocol/author/clocked_host.hpp"

namespace absenc::author {
namespace {

using namespace std::chrono_literals;
using Kind = Event<std::uint8_t>::Kind;

struct Toy {
  struct Format {
    std::uint32_t rate = 0;
    unsigned first_clocks = 8;
  };
  using Reply = std::uint8_t;
  static constexpr unsigned most_clocks = 20;
  static ClockedHostTimes host_times(const Format& format) { return {format.rate, 30us}; }
  static unsigned clocks(const Format& format) { return format.first_clocks; }
  static Result<Reply> decode(const Format&, BitView bits) {
    if (bits.load(0, 8) == 0xFF) return Error::line_stuck;
    return static_cast<Reply>(bits.load(0, 8));
  }
  static Reading reading(const Format&, const Reply& reply) { return {.singleturn = reply, .singleturn_bits = 8}; }
};

/// A host that repeats a transfer of 16 clocks plus the value of the first received byte, until it has made more
/// transfers than that value.
class Host final : public ClockedHostOf<Toy> {
 public:
  explicit Host(const Toy::Format& format) : ClockedHostOf(format) {}
  std::vector<std::size_t> seen;

 private:
  void clocked(BitView bits) override {
    seen.push_back(bits.size);
    const Error error = take(bits);
    if (error == Error::none) keep(last());
    if (error != Error::none || seen.size() > last()) return conclude(error);
    clock(16 + last());
  }
};

/// Feeds the host with `transfers`, each 100 us long. Returns as text what the host does.
std::string run(Host& host, const std::vector<std::vector<std::uint8_t>>& transfers) {
  std::string log;
  Time now = 1ms;
  std::size_t given = 0;
  for (int steps = 0; steps < 20; ++steps) {
    const ByteStep step = host.next(now);
    if (step.kind == ByteStep::Kind::done) return log + "done";
    if (step.kind == ByteStep::Kind::configure) log += "rate=" + std::to_string(step.rate) + " ";
    if (step.kind == ByteStep::Kind::wait) return log + "waits";
    if (step.kind != ByteStep::Kind::transfer) continue;
    log += std::to_string(step.bits) + " at " + std::to_string(step.at / 1us) + " ";
    EXPECT_EQ(host.next(now).kind, ByteStep::Kind::wait);
    now = step.at + 100us;
    host.feed({.kind = Kind::sent, .at = now});
    EXPECT_EQ(host.next(now).kind, ByteStep::Kind::wait);
    if (given < transfers.size()) host.feed({.kind = Kind::received, .at = now, .items = transfers[given++]});
  }
  return log + "never ends";
}

TEST(ClockedEngine, ClocksAfterTheRest) {
  Host host({});
  EXPECT_EQ(host.reading(), nullptr);
  EXPECT_EQ(run(host, {{0, 7, 7, 7}}), "8 at 1030 done");  // received bytes beyond the number of clocks are ignored
  EXPECT_EQ(host.error(), Error::none);
  ASSERT_NE(host.reading(), nullptr);
  EXPECT_EQ(host.reading()->latched, 1030us);
  EXPECT_EQ(host.reading()->received, 1130us);
  EXPECT_EQ(host.exchange().received.size(), 1u);
  EXPECT_EQ(host.exchange().sent_at, 1130us);
}

TEST(ClockedEngine, LineThatStaysLowIsNoPosition) {
  const auto error_of = [](std::uint8_t byte, bool idle_low) {
    Host host({});
    (void)host.next(1ms);
    const std::array bytes{byte};
    host.feed({.kind = Kind::sent, .at = 2ms});
    host.feed({.kind = Kind::received, .at = 2ms, .items = bytes, .idle_low = idle_low});
    return host.error();
  };
  EXPECT_EQ(error_of(0, false), Error::none);
  EXPECT_EQ(error_of(0, true), Error::line_stuck);
  // A line that was low before the first clock is not stuck if its bits change.
  EXPECT_EQ(error_of(0x01, true), Error::none);
}

TEST(ClockedEngine, KnownRateGivesTheBeginOfATransfer) {
  Host host({.rate = 100'000});
  EXPECT_EQ(run(host, {{0}}), "rate=100000 8 at 1030 done");
  EXPECT_EQ(host.reading()->latched, 1130us - 8 * 10us);
}

TEST(ClockedEngine, ATransferMayFollowAnotherWithMoreClocks) {
  Host host({});
  EXPECT_EQ(run(host, {{2, 9, 9}, {2, 0, 0}, {1, 0, 0}}), "8 at 1030 18 at 1160 18 at 1290 done");
  EXPECT_EQ(host.seen, (std::vector<std::size_t>{8, 18, 18}));
  EXPECT_EQ(host.reading()->singleturn, 1u);
  EXPECT_EQ(host.exchange().received.size(), 3u);
}

TEST(ClockedEngine, EndsIfStorageIsTooSmall) {
  Host stuck({});
  EXPECT_EQ(run(stuck, {{0xFF}}), "8 at 1030 done");
  EXPECT_EQ(stuck.error(), Error::line_stuck);
  EXPECT_EQ(stuck.reading(), nullptr);

  Host few({});
  EXPECT_EQ(run(few, {{1}, {1, 0}}), "8 at 1030 17 at 1160 done");
  EXPECT_EQ(few.error(), Error::wrong_length);
  EXPECT_EQ(few.reading(), nullptr);
  EXPECT_EQ(few.exchange().received.size(), 2u);

  Host many({.first_clocks = 25});  // 25 clocks need four bytes, and the storage has three
  EXPECT_EQ(run(many, {}), "done");
  EXPECT_EQ(many.error(), Error::invalid_argument);
  Host silent({.first_clocks = 24});
  EXPECT_EQ(run(silent, {}), "24 at 1030 waits");
}

class Device final : public ClockedDevice {
 public:
  Device() : ClockedDevice(1ms) {}
  std::string log;

 private:
  void selected(Time, Time period, bool, DrivenBits& bits) override {
    EXPECT_EQ(bits.size(), 0u);
    bits.append(0xA5, 8);
    log += "selected " + std::to_string(period.count()) + " ";
  }
  void clocked(Time, std::size_t clocks) override {
    log += "clocked " + std::to_string(clocks) + " ";
    count_answer();
  }
};

TEST(ClockedDevice, DrivesOnceForEachSelectionWhileItIsOn) {
  Device device;
  const auto select = [&device](Time at) {
    device.feed({.kind = Kind::selected, .at = at, .width = 5us});
    return device.next(at).kind == ByteStep::Kind::transfer;
  };
  const auto clocked = [&device](Time at, std::size_t bits) {
    device.feed({.kind = Kind::sent, .at = at, .bits = bits});
    return device.answer_count();
  };
  EXPECT_FALSE(select(0us));
  device.power_on(0us, Device::PowerOn::real);
  EXPECT_FALSE(select(999us));
  EXPECT_TRUE(select(1ms));
  EXPECT_FALSE(device.next(1ms).kind == ByteStep::Kind::transfer);
  EXPECT_EQ(clocked(2ms, 0), 0u);
  EXPECT_EQ(clocked(2ms, 8), 1u);
  EXPECT_EQ(clocked(2ms, 8), 1u);  // a second `sent` event for the same transfer is ignored
  EXPECT_TRUE(select(3ms));
  device.power_off(3ms);
  EXPECT_EQ(clocked(4ms, 8), 1u);
  EXPECT_FALSE(select(5ms));
  EXPECT_EQ(device.log, "selected 5000 clocked 8 selected 5000 ");
}

}  // namespace
}  // namespace absenc::author
