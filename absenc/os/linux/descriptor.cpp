// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/descriptor.hpp"

#include <unistd.h>

namespace absenc::os {

void Descriptor::close() {
  if (number_ >= 0) ::close(std::exchange(number_, -1));
}

}  // namespace absenc::os
