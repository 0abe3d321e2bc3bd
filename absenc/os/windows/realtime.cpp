// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/realtime.hpp"

#include "absenc/os/error.hpp"

namespace absenc::os {

void require_realtime(int) {
  throw Failure(Failure::Kind::unsupported,
                "Windows has no threads that are punctual like real-time ones: read without realtime");
}

}  // namespace absenc::os
