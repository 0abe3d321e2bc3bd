// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/realtime.hpp"

#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "absenc/os/error.hpp"

namespace absenc::os {
namespace {

// Runs `work` in a child process, so that its changes of limits do not last. Returns the text of `work`, or that of
// the Failure that it throws.
std::string in_child(const std::function<std::string()>& work) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child == 0) {
    std::string text;
    try {
      text = work();
    } catch (const Failure& failure) {
      text =
          std::string(failure.kind() == Failure::Kind::no_permission ? "no permission: " : "other: ") + failure.what();
    }
    static_cast<void>(::write(ends[1], text.data(), text.size()) + 0);
    ::_exit(0);
  }
  ::close(ends[1]);
  std::string text;
  std::array<char, 4096> buffer{};
  for (ssize_t size = 0; (size = ::read(ends[0], buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(size));
  }
  ::close(ends[0]);
  ::waitpid(child, nullptr, 0);
  return text;
}

// Removes a capability of this process and sets a resource limit, so that the kernel refuses real-time scheduling or
// locked memory even to root.
void give_up(unsigned capability, __rlimit_resource resource, rlim_t most = 0) {
  __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  std::array<__user_cap_data_struct, 2> data{};
  ASSERT_EQ(::syscall(SYS_capget, &header, data.data()), 0);
  data[capability / 32].effective &= ~(1u << capability % 32);
  ASSERT_EQ(::syscall(SYS_capset, &header, data.data()), 0);
  rlimit limit{};
  ::getrlimit(resource, &limit);
  const rlimit raised{most, std::max(limit.rlim_max, most)};
  // setrlimit fails if the hard limit must be raised, which only root may do
  if (::setrlimit(resource, &raised) == 0) return;
  limit.rlim_cur = std::min(limit.rlim_max, most);
  ASSERT_EQ(::setrlimit(resource, &limit), 0);
}

std::string scheduling() {
  sched_param parameters{};
  ::sched_getparam(0, &parameters);
  const int policy = ::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
  return (policy == SCHED_FIFO    ? "fifo "
          : policy == SCHED_OTHER ? "other "
                                  : "? ") +
         std::to_string(parameters.sched_priority);
}

// Returns whether the kernel allows this process real-time priority and locked memory; does not use the code under
// test.
bool kernel_allows() {
  const std::string allowed = in_child([] {
    const sched_param parameters{.sched_priority = 7};
    rlimit memory{};
    ::getrlimit(RLIMIT_MEMLOCK, &memory);
    const bool may_lock = memory.rlim_cur == RLIM_INFINITY || ::geteuid() == 0;
    return std::string(may_lock && ::sched_setscheduler(0, SCHED_FIFO, &parameters) == 0 ? "yes" : "no");
  });
  return allowed == "yes";
}

// Expects that `work` returns `expected`; on a test machine whose kernel refuses real-time scheduling or locked memory,
// expects that refusal.
void expect_or_refused(const std::string& expected, const std::function<std::string()>& work) {
  const std::string result = in_child(work);
  if (kernel_allows()) {
    EXPECT_EQ(result, expected);
  } else {
    EXPECT_EQ(result.find("no permission: the kernel refuses"), 0u) << result;
  }
}

TEST(RealTime, ThreadIsFifoOfItsPriority) {
  expect_or_refused("fifo 7", [] {
    require_realtime(7);
    return scheduling();
  });
}

TEST(RealTime, GreatestPriorityOfThreadCounts) {
  expect_or_refused("fifo 7, fifo 9", [] {
    require_realtime(7);
    require_realtime(3);
    const std::string first = scheduling();
    require_realtime(9);
    return first + ", " + scheduling();
  });
}

TEST(RealTime, ThreadsAndProcessesDoNotInheritIt) {
  expect_or_refused("other 0, other 0, fifo 7", [] {
    require_realtime(7);
    std::string of_thread;
    std::thread([&] { of_thread = scheduling(); }).join();
    return of_thread + ", " + in_child([] {
             const std::string before = scheduling();
             require_realtime(7);
             return before + ", " + scheduling();
           });
  });
}

TEST(RealTime, MemoryIsLocked) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer makes mlockall do nothing; tests/realtime_test.py looks at the command";
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
  GTEST_SKIP() << "AddressSanitizer makes mlockall do nothing; tests/realtime_test.py looks at the command";
#endif
#endif
  expect_or_refused("locked, locked", [] {
    const auto locked = [] {
      std::ifstream status("/proc/self/status");
      for (std::string line; std::getline(status, line);) {
        if (line.starts_with("VmLck:")) return line.find(" 0 kB") == std::string::npos ? "locked" : "not locked";
      }
      return "unknown";
    };
    require_realtime(7);
    const std::string here = locked();
    return here + ", " + in_child([&] {
             require_realtime(7);  // a child process does not inherit the memory lock
             return std::string(locked());
           });
  });
}

TEST(RealTime, RefusedPriorityHasThreeParts) {
  const std::string text = in_child([] {
    give_up(CAP_SYS_NICE, RLIMIT_RTPRIO);
    require_realtime(7);
    return std::string("not refused");
  });
  EXPECT_TRUE(text.starts_with("no permission: the kernel refuses ")) << text;
  if (kernel_allows()) {
    EXPECT_NE(text.find("real-time priority 7"), std::string::npos) << text;
    EXPECT_NE(text.find("Operation not permitted"), std::string::npos) << text;
    EXPECT_NE(text.find("`ulimit -r` is 0"), std::string::npos) << text;
  }
  for (const char* part : {"Try: ", "/etc/security/limits.conf", "systemd", "CAP_"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

TEST(RealTime, RefusedLockHasThreePartsAndLeavesThreadAsItWas) {
  const std::string text = in_child([] {
    give_up(CAP_IPC_LOCK, RLIMIT_MEMLOCK);
    try {
      require_realtime(7);
    } catch (const Failure& failure) {
      return scheduling() + ": " + failure.what();
    }
    return std::string("not refused");
  });
  EXPECT_TRUE(text.starts_with("other 0: the kernel refuses to lock the memory")) << text;
  for (const char* part : {"Operation not permitted", "`ulimit -l` is 0 kB", "Try: ", "LimitMEMLOCK", "CAP_IPC_LOCK"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

// With a finite limit of locked memory mlockall(2) may succeed, but the kernel would then refuse memory that the
// process requests later.
TEST(RealTime, FiniteLimitOfLockedMemoryIsRefused) {
  const std::string text = in_child([] {
    give_up(CAP_IPC_LOCK, RLIMIT_MEMLOCK, 64 << 20);
    require_realtime(7);
    return std::string("not refused");
  });
  EXPECT_TRUE(text.starts_with("no permission: the kernel refuses to lock the memory")) << text;
  EXPECT_EQ(text.find("`ulimit -l` is unlimited"), std::string::npos) << text;
  EXPECT_NE(text.find("`ulimit -l` is "), std::string::npos) << text;
}

}  // namespace
}  // namespace absenc::os
