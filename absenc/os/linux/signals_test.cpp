// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/signals.hpp"

#include <gtest/gtest.h>
#include <sys/time.h>

#include <csignal>
#include <thread>

#include "absenc/os/linux/testing.hpp"
#include "absenc/os/stream_port.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;
using namespace testing;

class Signals : public ::testing::Test {
 protected:
  Signals() { catch_interrupts(); }

  // Sends `signal` to this thread after `milliseconds`.
  static void signal_in(int milliseconds, int signal) {
    static pthread_t target;
    target = ::pthread_self();
    std::jthread([milliseconds, signal] {
      ::poll(nullptr, 0, milliseconds);
      ::pthread_kill(target, signal);
    }).detach();
  }
};

TEST_F(Signals, EndSleeping) {
  signal_in(20, SIGINT);
  EXPECT_THROW(sleep_until(never), Interrupted);
  EXPECT_TRUE(interrupted());
}

TEST_F(Signals, EndWaitingOnAPort) {
  PseudoTerminal terminal;
  DescriptorPort port(std::move(terminal.master), "the test");
  signal_in(20, SIGTERM);
  EXPECT_THROW(static_cast<void>(port.wait({.at = never})), Interrupted);
}

TEST_F(Signals, EndWaitingForTheTimeOfATransfer) {
  PseudoTerminal terminal;
  DescriptorPort port(std::move(terminal.master), "the test");
  const Data bytes{1};
  signal_in(20, SIGINT);
  EXPECT_THROW(port.begin(transfer(bytes, now() + 1h)), Interrupted);
}

TEST_F(Signals, EndWaitThatBeginsLater) {
  std::raise(SIGINT);
  EXPECT_THROW(sleep_until(never), Interrupted);
}

TEST_F(Signals, InterruptOnceEach) {
  std::raise(SIGINT);
  EXPECT_THROW(sleep_until(never), Interrupted);
  sleep_until(now() + 1ms);
  std::raise(SIGINT);
  EXPECT_THROW(sleep_until(never), Interrupted);
}

TEST_F(Signals, EndWaitOnBusyLine) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  const Descriptor reader(ends[0]), writer(ends[1]);
  put(writer.get(), {1});
  std::array<Watched, 1> watched{{{.descriptor = reader.get()}}};
  ASSERT_TRUE(wait_for(watched, never));
  std::raise(SIGTERM);
  EXPECT_THROW(wait_for(watched, never), Interrupted);
}

// SIGALRM interrupts the system call, but must not end the wait.
TEST_F(Signals, OfOtherKindsDoNotEndAWait) {
  struct sigaction action {};
  action.sa_handler = [](int) {};
  struct sigaction before {};
  ASSERT_EQ(::sigaction(SIGALRM, &action, &before), 0);
  const itimerval soon{{0, 0}, {0, 5000}};
  ASSERT_EQ(::setitimer(ITIMER_REAL, &soon, nullptr), 0);
  const Time end = now() + 20ms;
  EXPECT_FALSE(wait_for({}, end));
  EXPECT_GE(now(), end);
  ::sigaction(SIGALRM, &before, nullptr);
}

TEST(CancelCheck, EndsAWaitWithoutEvents) {
  int calls = 0;
  const std::function<bool()> over = [&] { return ++calls == 3; };
  const CancelCheck cancel_check(over);
  {
    const CancelCheck none({});
    EXPECT_FALSE(wait_for({}, now() + 50ms));
    EXPECT_EQ(calls, 0);
  }
  EXPECT_THROW(wait_for({}, never), Ended);
  EXPECT_EQ(calls, 3);
  EXPECT_FALSE(wait_for({}, now() + 50ms));
  EXPECT_GT(calls, 3);
}

TEST(WaitFor, ReportsReadyDescriptorsAfterTheDeadline) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  const Descriptor reader(ends[0]), writer(ends[1]);
  std::array<Watched, 1> watched{{{.descriptor = reader.get()}}};
  EXPECT_FALSE(wait_for(watched, Time{}));
  put(writer.get(), {1});
  EXPECT_TRUE(wait_for(watched, Time{}));
  EXPECT_TRUE(watched[0].ready.to_read);
  EXPECT_FALSE(watched[0].ready.to_write);
}

}  // namespace
}  // namespace absenc::os
