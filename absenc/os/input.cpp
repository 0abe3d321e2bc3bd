// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/input.hpp"

#include <cerrno>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

std::optional<std::size_t> read_standard_input(MutableBytes into, Time deadline) {
  for (;;) {
    Watched input{.descriptor = 0};
    if (!wait_for({&input, 1}, deadline)) return std::nullopt;
    const std::ptrdiff_t size = read_what_is_there(0, into);
    if (size >= 0) return static_cast<std::size_t>(size);
    if (errno != EAGAIN && errno != EINTR) throw system_failure("reading standard input", errno);
  }
}

}  // namespace absenc::os
