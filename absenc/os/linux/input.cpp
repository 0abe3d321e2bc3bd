// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/input.hpp"

#include <unistd.h>

#include <cerrno>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

std::optional<std::size_t> read_standard_input(MutableBytes into, Time deadline) {
  for (;;) {
    Watched input{.descriptor = STDIN_FILENO};
    if (!wait_for({&input, 1}, deadline)) return std::nullopt;
    const ssize_t size = ::read(STDIN_FILENO, into.data(), into.size());
    if (size >= 0) return static_cast<std::size_t>(size);
    if (errno == EAGAIN || errno == EINTR) continue;
    throw system_failure("reading standard input", errno);
  }
}

}  // namespace absenc::os
