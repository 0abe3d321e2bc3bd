// SPDX-License-Identifier: Apache-2.0
// Windows does not say which process has a port open, so no program could look up the server of that process.
#include "absenc/os/served_port.hpp"

namespace absenc::os {

void ServedPorts::set(const std::vector<std::string>&) {}

}  // namespace absenc::os
