// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/stream_port.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <numeric>
#include <thread>

#include "absenc/os/linux/testing.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;
using Kind = ByteEvent::Kind;

class TestPort : public DescriptorPort {
 public:
  using DescriptorPort::DescriptorPort;
  using DescriptorPort::set_character_time;
};

class StreamPortTest : public ::testing::Test {
 protected:
  static std::array<Descriptor, 2> pair() {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) < 0) throw system_failure("socketpair", errno);
    return {Descriptor(ends[0]), Descriptor(ends[1])};
  }

  std::array<Descriptor, 2> ends_ = pair();
  Descriptor& peer_ = ends_[1];
  TestPort port_{std::move(ends_[0]), "the line"};
  const Data request_{0x1A, 0x02};
};

TEST_F(StreamPortTest, SendsThenReceives) {
  port_.begin(transfer(request_));
  EXPECT_EQ(get(peer_.get()), request_);
  put(peer_.get(), {7, 8, 9});
  const ByteEvent sent = port_.wait({.at = never});
  ASSERT_EQ(sent.kind, Kind::sent);
  const ByteEvent received = port_.wait({.at = never});
  ASSERT_EQ(received.kind, Kind::received);
  EXPECT_EQ(data(received.items), (Data{7, 8, 9}));
  EXPECT_GE(received.at, sent.at);
  EXPECT_LE(received.at, now());
}

TEST_F(StreamPortTest, SendsNothingBeforeItsTime) {
  const Time at = now() + 3ms;
  std::jthread sender([&] { port_.begin(transfer(request_, at)); });
  EXPECT_EQ(get(peer_.get()), request_);
  EXPECT_GE(now(), at);
  sender.join();
  EXPECT_GE(port_.wait({}).at, at);
}

TEST_F(StreamPortTest, SendsFramesOfATransferWithTheirPauses) {
  constexpr Time pause = 3ms;
  const Data frames{1, 2, 3, 4, 5};
  const Time before = now();
  std::jthread sender(
      [&] { port_.begin({.kind = ByteStep::Kind::transfer, .frame = 2, .out = frames, .width = pause}); });
  Data received;
  while (received.size() < frames.size()) {
    const Data more = get(peer_.get());
    ASSERT_FALSE(more.empty());
    received.insert(received.end(), more.begin(), more.end());
    if (received.size() > 2) {
      EXPECT_GE(now(), before + pause);
    }
  }
  EXPECT_GE(now(), before + 2 * pause);
  EXPECT_EQ(received, frames);
  sender.join();
  const ByteEvent sent = port_.wait({.at = never});
  EXPECT_EQ(sent.kind, Kind::sent);
  EXPECT_GE(sent.at, before + 2 * pause);
}

TEST_F(StreamPortTest, SendsAtOnceWithinTheSlack) {
  port_.set_send_slack(1h);
  const Time at = now() + 30min;
  port_.begin(transfer(request_, at));
  EXPECT_EQ(get(peer_.get()), request_);
  EXPECT_LT(port_.wait({}).at, at);
}

TEST_F(StreamPortTest, ComputesTheEndOfSending) {
  port_.set_character_time(1s);
  const Time before = now();
  port_.begin(transfer(request_));
  const Time first = port_.wait({}).at;
  EXPECT_GE(first, before + 2s);
  EXPECT_LE(first, now() + 2s);
  port_.begin(transfer(request_));
  EXPECT_EQ(port_.wait({}).at, first + 2s);  // the second transfer is sent after the end of the first one
}

TEST_F(StreamPortTest, AnEchoDoesNotComeBeforeTheEndOfSending) {
  port_.set_character_time(1s);
  port_.begin(transfer(request_));
  const Time sent = port_.wait({}).at;
  put(peer_.get(), request_);
  EXPECT_EQ(port_.wait({.at = never}).at, sent);
}

TEST_F(StreamPortTest, ReportsSilenceOnceWhenNoAnswerComes) {
  port_.set_latency(2ms);
  port_.begin(transfer(request_));
  const Time sent = port_.wait({}).at;
  const ByteEvent silence = port_.wait({.at = never, .answer = 1ms, .gap = 1h});
  ASSERT_EQ(silence.kind, Kind::silence);
  EXPECT_GE(silence.at, sent + 3ms);
  EXPECT_EQ(port_.wait({.at = port_.now() + 3ms, .answer = 1ms}).kind, Kind::timer);
  port_.begin(transfer(request_));
  EXPECT_EQ(port_.wait({}).kind, Kind::sent);
  EXPECT_EQ(port_.wait({.at = never, .answer = 1ms}).kind, Kind::silence);
}

TEST_F(StreamPortTest, ReportsSilenceOnceAfterAGap) {
  port_.set_latency(2ms);
  put(peer_.get(), {1});
  // The gap limit applies only after a received byte, so no silence is reported before the first byte.
  EXPECT_EQ(port_.wait({.at = never, .gap = 1ns}).kind, Kind::received);
  const ByteEvent silence = port_.wait({.at = never, .answer = 1ns, .gap = 1ms});
  ASSERT_EQ(silence.kind, Kind::silence);
  EXPECT_EQ(port_.wait({.at = port_.now() + 5ms, .gap = 1ms}).kind, Kind::timer);
  put(peer_.get(), {2});
  const ByteEvent received = port_.wait({.at = never, .gap = 1ms});
  ASSERT_EQ(received.kind, Kind::received);
  const Time last = received.at;
  const ByteEvent again = port_.wait({.at = never, .gap = 1ms});
  ASSERT_EQ(again.kind, Kind::silence);
  EXPECT_GE(again.at, last + 3ms);
}

TEST_F(StreamPortTest, ReportsAvailableBytesBeforeSilence) {
  port_.begin(transfer(request_));
  const Time sent = port_.wait({}).at;
  put(peer_.get(), {1});
  sleep_until(sent + 2ms);
  EXPECT_EQ(port_.wait({.at = never, .answer = 1ms}).kind, Kind::received);
}

TEST_F(StreamPortTest, ReportsTimerOnceWhenDue) {
  const Time at = port_.now() + 2ms;
  const ByteEvent timer = port_.wait({.at = at});
  ASSERT_EQ(timer.kind, Kind::timer);
  EXPECT_GE(timer.at, at);
  static_cast<void>(port_.now());
  const Time next = now() + 2ms;
  port_.set_end(next);
  EXPECT_THROW(static_cast<void>(port_.wait({.at = at})), Ended);
}

TEST_F(StreamPortTest, IgnoresTimerInThePast) {
  port_.begin(transfer(request_));
  EXPECT_EQ(port_.wait({}).kind, Kind::sent);
  const Time past = port_.now() - 1ns;
  EXPECT_EQ(port_.wait({.at = past, .answer = 1ms}).kind, Kind::silence);
}

TEST_F(StreamPortTest, ReportsTimerThatPassesMeanwhile) {
  const Time at = port_.now() + 1ms;
  put(peer_.get(), {1});
  sleep_until(at);
  EXPECT_EQ(port_.wait({.at = at}).kind, Kind::received);
  static_cast<void>(port_.now());
  EXPECT_EQ(port_.wait({.at = at}).kind, Kind::timer);
}

TEST_F(StreamPortTest, ReportsTimerThatPassesWhileSending) {
  port_.begin(transfer(request_));
  const Time at = port_.now() + 1ms;
  sleep_until(at);
  EXPECT_EQ(port_.wait({.at = at}).kind, Kind::sent);
  static_cast<void>(port_.now());
  EXPECT_EQ(port_.wait({.at = at}).kind, Kind::timer);
}

TEST_F(StreamPortTest, ReportsEarlierOfTimerAndSilenceFirst) {
  // The port must report the earlier event first, even if both times have passed before it checks.
  const auto first_of = [this](Time timer, Time answer) {
    port_.begin(transfer(request_));
    const Time sent = port_.wait({}).at;
    const ByteStep step{.at = sent + timer, .answer = answer};
    EXPECT_LT(port_.now(), step.at);
    sleep_until(sent + std::max(timer, answer));
    const Kind first = port_.wait(step).kind;
    EXPECT_NE(port_.wait(step).kind, first);
    return first;
  };
  EXPECT_EQ(first_of(50ms, 40ms), Kind::silence);
  EXPECT_EQ(first_of(40ms, 50ms), Kind::timer);
}

TEST_F(StreamPortTest, WaitsForAnAnswerAfterEachTransfer) {
  put(peer_.get(), {1});
  EXPECT_EQ(port_.wait({.at = never}).kind, Kind::received);
  port_.begin(transfer(request_));
  EXPECT_EQ(port_.wait({.at = never}).kind, Kind::sent);
  port_.set_end(now() + 5s);
  // Silence is counted from the transfer, although a byte was received before it.
  EXPECT_EQ(port_.wait({.at = never, .answer = 1ms}).kind, Kind::silence);
}

TEST_F(StreamPortTest, ContinuesWritingToSlowPeer) {
  Data many(1'000'000);
  std::iota(many.begin(), many.end(), std::uint8_t{0});
  Data got;
  std::jthread reader([&] {
    while (got.size() < many.size()) {
      const Data part = get(peer_.get());
      if (part.empty()) return;
      got.insert(got.end(), part.begin(), part.end());
    }
  });
  port_.begin(transfer(many));
  reader.join();
  EXPECT_EQ(got, many);
}

TEST_F(StreamPortTest, EndsWhilePeerReadsNothing) {
  const Data many(1'000'000);
  const Time end = now() + 5ms;
  port_.set_end(end);
  EXPECT_THROW(port_.begin(transfer(many)), Ended);
  // the time of `set_end` ended the write before the 3 s after which a silent reader counts as lost
  EXPECT_LT(now(), end + 2s);
}

TEST_F(StreamPortTest, EndsWhileWaiting) {
  const Time end = now() + 3ms;
  port_.set_end(end);
  EXPECT_THROW(static_cast<void>(port_.wait({.at = never})), Ended);
  EXPECT_GE(now(), end);
  put(peer_.get(), {1});
  EXPECT_THROW(static_cast<void>(port_.wait({.at = never})), Ended);
  EXPECT_THROW(port_.begin(transfer(request_, never)), Ended);
}

TEST_F(StreamPortTest, IsLostWhenTheOtherSideCloses) {
  put(peer_.get(), {1});
  peer_.close();
  // Bytes received before the other side closed are not lost.
  EXPECT_EQ(port_.wait({.at = never}).kind, Kind::received);
  errno = EAGAIN;  // errno has a value of an earlier call, because a read at the end of a stream does not set errno
  const Failure failure = failure_of([&] { static_cast<void>(port_.wait({.at = never})); });
  EXPECT_EQ(failure.kind(), Failure::Kind::lost);
  EXPECT_STREQ(failure.what(), "the line went away: unplugged, or closed at the other end?");
}

TEST_F(StreamPortTest, HasNoWiresAndNoRate) {
  const auto begin = [&](ByteStep::Kind kind) { return [this, kind] { port_.begin({.kind = kind}); }; };
  EXPECT_EQ(failure_of(begin(ByteStep::Kind::pulse)).kind(), Failure::Kind::unsupported);
  EXPECT_EQ(failure_of(begin(ByteStep::Kind::configure)).kind(), Failure::Kind::unsupported);
}

class PulsePort : public DescriptorPort {
 public:
  using DescriptorPort::DescriptorPort;
  using DescriptorPort::set_character_time;
  std::vector<Time> edges;
  Time applied{};

 private:
  void drive(ExtraWire wire, bool active) override {
    EXPECT_EQ(wire, ExtraWire::clear);
    EXPECT_EQ(active, edges.size() % 2 == 0);
    edges.push_back(os::now());
  }
  void change_rate(std::uint32_t) override { applied = os::now(); }
};

TEST_F(StreamPortTest, DrivesAPulse) {
  PulsePort port(std::move(peer_), "the line");
  const Time at = now() + 1ms;
  port.begin({.kind = ByteStep::Kind::pulse, .wire = ExtraWire::clear, .at = at, .width = 50us});
  ASSERT_EQ(port.edges.size(), 2u);
  EXPECT_GE(port.edges[0], at);
  EXPECT_GE(port.edges[1], port.edges[0] + 50us);
  const ByteEvent sent = port.wait({});
  EXPECT_EQ(sent.kind, Kind::sent);
  EXPECT_GE(sent.at, port.edges[1]);
}

TEST_F(StreamPortTest, ReleasesTheWireOfAPulseThatIsCutShort) {
  PulsePort port(std::move(peer_), "the line");
  port.set_end(now() + 3ms);
  EXPECT_THROW(port.begin({.kind = ByteStep::Kind::pulse, .wire = ExtraWire::clear, .width = 1h}), Ended);
  EXPECT_EQ(port.edges.size(), 2u);
}

TEST_F(StreamPortTest, ChangesTheRateAfterTheLastCharacter) {
  PulsePort port(std::move(peer_), "the line");
  port.set_character_time(1ms);
  port.begin(transfer(request_));
  const Time sent = port.wait({}).at;
  port.begin({.kind = ByteStep::Kind::configure, .rate = 9600});
  EXPECT_GE(port.applied, sent);
}

}  // namespace
}  // namespace absenc::os
