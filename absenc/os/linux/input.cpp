// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/input.hpp"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>

namespace absenc::os {

std::ptrdiff_t read_what_is_there(int descriptor, MutableBytes into) {
  pollfd readable{descriptor, POLLIN, 0};
  if (::poll(&readable, 1, 0) > 0) return ::read(descriptor, into.data(), into.size());
  errno = EAGAIN;
  return -1;
}

void allow_background(int descriptor) {
  if (::isatty(descriptor) == 1) static_cast<void>(::signal(SIGTTIN, SIG_IGN));
}

}  // namespace absenc::os
