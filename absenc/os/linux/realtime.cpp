// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/realtime.hpp"

#include <linux/capability.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <mutex>
#include <string>
#include <system_error>

#include "absenc/os/error.hpp"

namespace absenc::os {

namespace {

// With SCHED_RESET_ON_FORK, threads and processes that the thread starts do not inherit its priority.
constexpr int policy = SCHED_FIFO | SCHED_RESET_ON_FORK;

std::string text_of(rlim_t limit, rlim_t unit, const std::string& unit_name) {
  return limit == RLIM_INFINITY ? "unlimited" : std::to_string(limit / unit) + unit_name;
}

[[noreturn]] void refuse_realtime(const std::string& what, const std::string& evidence, const std::string& advice,
                                  int error) {
  const bool is_permission = error == EPERM || error == ENOMEM || error == EAGAIN;
  throw Failure(is_permission ? Failure::Kind::no_permission : Failure::Kind::system,
                "the kernel refuses " + what + ". " + evidence + ". Try: " + advice + ", or read without realtime");
}

// Number of the process that has locked its memory; 0: none. Child processes do not inherit the lock.
pid_t locked_by = 0;

void unlock_memory() {
  ::munlockall();
  locked_by = 0;
}

bool has_capability(unsigned capability) {
  __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> data{};
  return ::syscall(SYS_capget, &header, data.data()) == 0 &&
         (data[capability / 32].effective & 1u << capability % 32) != 0;
}

// Locks all memory. Returns 0 or a value of errno.
int lock_all(rlim_t limit) {
  // With a finite limit of locked memory, the kernel would refuse memory that is requested later instead of leaving it
  // unlocked: a new thread or a large vector would fail.
  if (limit != RLIM_INFINITY && !has_capability(CAP_IPC_LOCK)) return EPERM;
  // MCL_ONFAULT locks later pages when they are used: the whole stacks of later threads would cost 8 MB each.
  return ::mlockall(MCL_CURRENT) == 0 && ::mlockall(MCL_FUTURE | MCL_ONFAULT) == 0 ? 0 : errno;
}

void lock_memory() {
  rlimit limit{};
  ::getrlimit(RLIMIT_MEMLOCK, &limit);
  const int error = lock_all(limit.rlim_cur);
  if (error == 0) {
    locked_by = ::getpid();
    return;
  }
  unlock_memory();
  refuse_realtime(
      "to lock the memory of this process, which realtime needs",
      "The answer is: " + std::generic_category().message(error) + ", and `ulimit -l` is " +
          text_of(limit.rlim_cur, 1024, " kB"),
      "memlock unlimited in /etc/security/limits.conf, LimitMEMLOCK=infinity in a systemd unit, or CAP_IPC_LOCK",
      error);
}

}  // namespace

void require_realtime(int priority) {
  thread_local int present = 0;
  // `present` alone does not suffice: a forked process inherits its value, although the thread of that process is no
  // real-time thread for the kernel.
  if (priority <= present && ::sched_getscheduler(0) == policy) return;
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  const bool is_locked = locked_by == ::getpid();
  if (!is_locked) lock_memory();
  sched_param wanted{};
  wanted.sched_priority = priority;
  // On Linux, process 0 means the calling thread.
  if (::sched_setscheduler(0, policy, &wanted) == 0) {
    present = priority;
    return;
  }
  const int error = errno;
  if (!is_locked) unlock_memory();
  rlimit limit{};
  ::getrlimit(RLIMIT_RTPRIO, &limit);
  const std::string number = std::to_string(priority);
  refuse_realtime("real-time priority " + number + " to the thread that reads",
                  "The answer is: " + std::generic_category().message(error) + ", and `ulimit -r` is " +
                      text_of(limit.rlim_cur, 1, ""),
                  "rtprio " + number + " in /etc/security/limits.conf, LimitRTPRIO=" + number +
                      " and RestrictRealtime=no in a systemd unit, or CAP_SYS_NICE",
                  error);
}

}  // namespace absenc::os
