// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/stream_port.hpp"

namespace absenc::os {

DescriptorPort::DescriptorPort(Descriptor descriptor, std::string name)
    : descriptor_(std::move(descriptor)), name_(std::move(name)) {
  const int flags = ::fcntl(descriptor_.get(), F_GETFL);
  if (flags < 0 || ::fcntl(descriptor_.get(), F_SETFL, flags | O_NONBLOCK) < 0) throw system_failure(name_, errno);
  poller().add(descriptor_.get());
}

std::ptrdiff_t DescriptorPort::write_some(Bytes bytes) { return ::write(descriptor(), bytes.data(), bytes.size()); }

std::ptrdiff_t DescriptorPort::read_once(MutableBytes into) { return ::read(descriptor(), into.data(), into.size()); }

}  // namespace absenc::os
