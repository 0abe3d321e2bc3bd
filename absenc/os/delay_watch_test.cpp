// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/delay_watch.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>

#include "absenc/os/signals.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;

// Stops a process with a DelayWatch for at least 60 ms. Returns 0 if that process then measured 50 ms or more within
// 10 s, else 1.
int measured_while_stopped(bool terminals) {
  const pid_t child = ::fork();
  if (child == 0) {
    const DelayWatch watch(terminals);
    while (watch.latest() == Time{}) sleep_until(now() + 1ms);  // until its thread runs
    ::raise(SIGSTOP);
    for (const Time end = now() + 10s; watch.latest() < 50ms && now() < end;) sleep_until(now() + 1ms);
    ::_exit(watch.latest() < 50ms ? 1 : 0);
  }
  int status = 0;
  ::waitpid(child, &status, WUNTRACED);
  sleep_until(now() + 60ms);  // the delay itself: the watch began its sleep of 1 ms before the process stopped
  ::kill(child, SIGCONT);
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

TEST(DelayWatch, MeasuresHowLongTheProcessStoodStill) {
  EXPECT_EQ(measured_while_stopped(false), 0);
  EXPECT_EQ(measured_while_stopped(true), 0);
}

TEST(DelayWatch, BytesTakeTimeThroughTerminals) {
  const DelayWatch watch(true);
  const Time end = now() + 10s;
  while (watch.latest() == Time{} && now() < end) sleep_until(now() + 1ms);
  EXPECT_GT(watch.latest(), Time{});
}

}  // namespace
}  // namespace absenc::os
