// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/cyclic_host.hpp"

#include <gtest/gtest.h>

namespace absenc::host {
namespace {

using namespace std::chrono_literals;
using Steps = Step<std::uint8_t>;

/// A conversation that ends at once, with a position and the given error.
struct EndsAtOnce final : Conversation<std::uint8_t> {
  void feed(const Event<std::uint8_t>&) override {}
  Steps next(Time) override { return {.kind = Steps::Kind::done}; }
  [[nodiscard]] Error error() const override { return result; }
  [[nodiscard]] const Reading* reading() const override { return &position; }
  void report(FieldSink&) const override {}
  [[nodiscard]] Exchange<std::uint8_t> exchange() const override { return {}; }
  Reading position{.singleturn = 5, .singleturn_bits = 13, .singleturn_valid_bits = 13, .latched = 1ms};
  Error result = Error::none;
};

/// A host whose every cycle of 1 ms has the result of `conversation`.
struct Cycles {
  const Cycle& run() {
    EXPECT_EQ(host.next(now).kind, Steps::Kind::emit);
    now += 1ms;
    return host.cycle();
  }
  EndsAtOnce conversation;
  struct Read {
    Conversation<std::uint8_t>& operator()() const { return *reads; }
    EndsAtOnce* reads;
  };
  Time now = 1ms;
  CyclicHost<std::uint8_t, Read> host{Read{&conversation}, {.period = 1ms}, now};
};

TEST(Cycle, AgeIsTheTimeSinceTheLatch) {
  Cycles cycles;
  EXPECT_EQ(cycles.run().age(1ms + 300us), 300us);
  EXPECT_EQ(cycles.run().age(3ms), 2ms);
}

// A reading may end with an error after its position was received, for example if its alarms cannot be read.
TEST(CyclicHost, PositionOfAFailedReadingIsMissing) {
  Cycles cycles;
  EXPECT_EQ(cycles.run().kind, Cycle::Kind::fresh);
  cycles.conversation.result = Error::bad_checksum;
  cycles.conversation.position.singleturn = 6;
  const Cycle& failed = cycles.run();
  EXPECT_EQ(failed.kind, Cycle::Kind::missing);
  EXPECT_EQ(failed.error, Error::bad_checksum);
  EXPECT_EQ(failed.reading.singleturn, 5u) << "that of the cycle before";
  EXPECT_EQ(failed.stale, 1u);
  cycles.conversation.result = Error::none;
  EXPECT_EQ(cycles.run().kind, Cycle::Kind::fresh);
  EXPECT_EQ(cycles.host.cycle().stale, 0u);
}

}  // namespace
}  // namespace absenc::host
