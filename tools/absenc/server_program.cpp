// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "absenc/os/program.hpp"
#include "tools/absenc/parts.hpp"

namespace absenc::tool {

int run_program(const Subcommand& subcommand, std::span<char* const> words) {
  const std::string path = path_of_part(subcommand.program);
  if (!os::is_file(path)) report_missing(fmt::format("`absenc {}`", subcommand.name), path, subcommand.package);
  os::become_program(path, "absenc", words);
}

}  // namespace absenc::tool
