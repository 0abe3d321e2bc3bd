// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/process.hpp"

namespace absenc::os {

void replace_file(const std::string& path, std::string_view content, Durable durable) {
  NewFile file(path);
  file.write(content);
  file.take_place(durable);
}

}  // namespace absenc::os
