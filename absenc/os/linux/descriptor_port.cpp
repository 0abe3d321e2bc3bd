// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/stream_port.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

DescriptorPort::DescriptorPort(Descriptor descriptor, std::string name)
    : descriptor_(std::move(descriptor)), name_(std::move(name)) {
  const int flags = ::fcntl(descriptor_.get(), F_GETFL);
  if (flags < 0 || ::fcntl(descriptor_.get(), F_SETFL, flags | O_NONBLOCK) < 0) throw system_failure(name_, errno);
  poller().add(descriptor_.get());
}

std::ptrdiff_t DescriptorPort::write_some(Bytes bytes) { return ::write(descriptor(), bytes.data(), bytes.size()); }

std::size_t DescriptorPort::read_some(MutableBytes into, std::span<const int>) {
  const ssize_t size = ::read(descriptor(), into.data(), into.size());
  if (size > 0) return static_cast<std::size_t>(size);
  if (size == 0) fail(0);
  if (errno != EAGAIN && errno != EINTR) fail(errno);
  return 0;
}

void DescriptorPort::write_all(Bytes bytes) {
  // If the other side reads no byte for this long, it counts as lost.
  constexpr Time patience = 3s;
  for (;;) {
    const ssize_t size = write_some(bytes);
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
