// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/parts.hpp"

#include <fmt/format.h>

#include "absenc/os/program.hpp"
#include "tools/absenc/error.hpp"

namespace absenc::tool {

std::string path_of_part(std::string_view name) {
  return os::folder_of_program() + "/../lib/absenc/" + std::string(name);
}

void report_missing(std::string_view purpose, std::string_view path, std::string_view package) {
#ifdef ABSENC_PARTS_LEFT_OUT
  throw Failure(
      fmt::format("{} is not in this build of absenc, nor is the package {}: {} says what was left out and why",
                  purpose, package, ABSENC_PARTS_LEFT_OUT));
#endif
  throw Failure(fmt::format("{} is a part of absenc that is not installed: {} is not there. Install the package {}",
                            purpose, path, package));
}

}  // namespace absenc::tool
