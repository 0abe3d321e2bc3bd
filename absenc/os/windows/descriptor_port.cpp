// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "absenc/os/stream_port.hpp"
#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {

DescriptorPort::DescriptorPort(Descriptor descriptor, std::string name)
    : descriptor_(std::move(descriptor)), name_(std::move(name)) {
  poller().add(descriptor_.get());
}

std::ptrdiff_t DescriptorPort::write_some(Bytes bytes) { return waitable_of(descriptor())->write(bytes); }

std::ptrdiff_t DescriptorPort::read_once(MutableBytes into) { return waitable_of(descriptor())->read(into); }

}  // namespace absenc::os
