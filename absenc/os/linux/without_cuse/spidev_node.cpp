// SPDX-License-Identifier: Apache-2.0
// Replaces linux/cuse/spidev_node.cpp in programs that are built without libfuse.
#include "absenc/os/spidev_node.hpp"

#include "absenc/os/error.hpp"

struct fuse_session {};

namespace absenc::os {

SpidevNode::SpidevNode(const std::string& path, Spidev&) {
  throw Failure(Failure::Kind::unsupported, "this program cannot emulate the SPI device " + path +
                                                ": it was built without libfuse; use absenc from its Debian packages");
}

SpidevNode::~SpidevNode() = default;

void SpidevNode::serve(Time) {}

void SpidevNode::CloseSession::operator()(fuse_session*) const {}

}  // namespace absenc::os
