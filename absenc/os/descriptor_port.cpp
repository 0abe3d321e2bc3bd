// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/stream_port.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

std::size_t DescriptorPort::read_some(MutableBytes into, std::span<const int>) {
  const std::ptrdiff_t size = read_once(into);
  if (size > 0) return static_cast<std::size_t>(size);
  if (size == 0) fail(0);
  if (errno != EAGAIN && errno != EINTR) fail(errno);
  return 0;
}

void DescriptorPort::write_all(Bytes bytes) {
  // If the other side reads no byte for this long, it counts as lost.
  constexpr Time patience = 3s;
  for (;;) {
    const std::ptrdiff_t size = write_some(bytes);
    if (size < 0 && errno != EAGAIN && errno != EINTR) fail(errno);
    if (size > 0) bytes = bytes.subspan(static_cast<std::size_t>(size));
    if (bytes.empty()) return;
    Watched writable{.descriptor = descriptor(), .wanted = {.to_write = true}};
    const Time limit = os::now() + patience;
    if (wait_for({&writable, 1}, std::min(limit, end()))) continue;
    if (os::now() >= end()) throw Ended{};
    throw Failure(Failure::Kind::lost, name_ + " takes no more bytes: is the other end still running?");
  }
}

void DescriptorPort::fail(int error) const {
  switch (error) {
    case 0:  // end of the stream: the other side has closed it
    case EIO:
    case ENXIO:
    case ENODEV:
    case EPIPE:
    case ECONNRESET:
    case ETIMEDOUT:
      throw Failure(Failure::Kind::lost, name_ + " went away: unplugged, or closed at the other end?");
    default:
      throw system_failure(name_, error);
  }
}

}  // namespace absenc::os
