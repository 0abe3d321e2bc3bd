// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/hangup.hpp"

#include <pthread.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>

#include "absenc/os/error.hpp"

namespace absenc::os {

Descriptor catch_hangups() {
  sigset_t hangup;
  sigemptyset(&hangup);
  sigaddset(&hangup, SIGHUP);
  // SIGHUP is blocked; new threads inherit the signal mask, so the signal reaches only the descriptor.
  if (const int error = ::pthread_sigmask(SIG_BLOCK, &hangup, nullptr)) throw system_failure("pthread_sigmask", error);
  Descriptor descriptor(::signalfd(-1, &hangup, SFD_NONBLOCK | SFD_CLOEXEC));
  if (!descriptor) throw system_failure("signalfd", errno);
  return descriptor;
}

bool take_hangup(const Descriptor& hangups) {
  signalfd_siginfo received{};
  return ::read(hangups.get(), &received, sizeof received) > 0;
}

}  // namespace absenc::os
