// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/delay_watch.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "absenc/os/signals.hpp"

namespace absenc::os {
namespace {

using namespace std::chrono_literals;

// Starts a process in which a DelayWatch runs, and stops it for 60 ms or more. Returns 0 if the DelayWatch then
// measures a delay of at least 50 ms.
int measured_while_stopped(bool terminals) {
  const pid_t child = ::fork();
  if (child == 0) {
    const DelayWatch watch(terminals);
    while (watch.latest() == Time{}) sleep_until(now() + 1ms);  // waits until the thread of the DelayWatch runs
    ::raise(SIGSTOP);
    for (const Time end = now() + 10s; watch.latest() < 50ms && now() < end;) sleep_until(now() + 1ms);
    ::_exit(watch.latest() < 50ms ? 1 : 0);
  }
  int status = 0;
  ::waitpid(child, &status, WUNTRACED);
  // The process is stopped for 60 ms, so that at least 50 ms are measured: a sleep of 1 ms, which the DelayWatch had
  // begun before the stop, does not count.
  sleep_until(now() + 60ms);
  ::kill(child, SIGCONT);
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

TEST(DelayWatch, MeasuresHowLongTheProcessStoodStill) {
  EXPECT_EQ(measured_while_stopped(false), 0);
  EXPECT_EQ(measured_while_stopped(true), 0);
}

// Returns the paths of the pseudo-terminals' slaves that this process has open.
std::set<std::string> open_slaves() {
  std::set<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    // reading the link of a descriptor fails if the descriptor was closed meanwhile
    std::error_code closed;
    const std::string path = std::filesystem::read_symlink(entry.path(), closed);
    if (path.starts_with("/dev/pts/")) paths.insert(path);
  }
  return paths;
}

/// Reads the byte that the DelayWatch sent through one of its pseudo-terminals, so that the DelayWatch waits for this
/// byte for ever.
TEST(DelayWatch, ByteThatDoesNotArriveIsLate) {
  const std::set<std::string> before = open_slaves();
  const DelayWatch watch(true);
  std::vector<Descriptor> slaves;
  for (const std::string& path : open_slaves()) {
    if (!before.contains(path)) slaves.emplace_back(::open(path.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  }
  ASSERT_EQ(slaves.size(), 4u);
  const auto take = [](const Descriptor& slave) {
    char byte = 0;
    return ::read(slave.get(), &byte, 1) == 1;
  };
  const Time end = now() + 10s;
  while (std::ranges::none_of(slaves, take) && now() < end) continue;
  const Time taken = now();
  while (now() < taken + 300ms) sleep_until(now() + 1ms);
  EXPECT_GE(watch.latest(), 250ms);
}

}  // namespace
}  // namespace absenc::os
