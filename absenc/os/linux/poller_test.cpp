// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/poller.hpp"

#include <gtest/gtest.h>
#include <sys/eventfd.h>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;

TEST(Poller, ReturnsAtTheDeadlineAndNeverBefore) {
  Poller poller;
  // The timer of one wait must not end the next wait early.
  for (const Time ahead : {5ms, 1ms, 10ms, 2ms}) {
    const Time deadline = now() + ahead;
    EXPECT_TRUE(poller.wait(deadline).empty());
    EXPECT_GE(now(), deadline);
  }
  const Time past = now() - 1ms;
  EXPECT_TRUE(poller.wait(past).empty());
  EXPECT_TRUE(poller.wait(Time{}).empty());
}

TEST(Poller, ReturnsReadableDescriptors) {
  Poller poller;
  const Descriptor first(::eventfd(0, EFD_NONBLOCK));
  const Descriptor second(::eventfd(1, EFD_NONBLOCK));
  poller.add(first.get());
  poller.add(second.get());
  const auto ready = poller.wait(never);
  ASSERT_EQ(ready.size(), 1u);
  EXPECT_EQ(ready[0], second.get());
  poller.remove(second.get());
  EXPECT_TRUE(poller.wait(now() + 1ms).empty());
}

TEST(Poller, ChecksForCancellation) {
  int calls = 0;
  const std::function<bool()> over = [&] { return ++calls == 3; };
  const CancelCheck cancel_check(over);
  Poller poller;
  EXPECT_THROW(static_cast<void>(poller.wait(never)), Ended);
  EXPECT_EQ(calls, 3);
}

TEST(Poller, ReturnsReadyDescriptorsAfterTheDeadline) {
  Poller poller;
  const Descriptor ready(::eventfd(1, EFD_NONBLOCK));
  poller.add(ready.get());
  EXPECT_EQ(poller.wait(now() - 1ms).size(), 1u);
}

}  // namespace
}  // namespace absenc::os
