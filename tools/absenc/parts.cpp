// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/parts.hpp"

#include <fmt/format.h>

#include <vector>

#include "absenc/client/recording/record_file.hpp"
#include "absenc/os/program.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/version.hpp"
#include "tools/hdf5/plugin.hpp"

namespace absenc::tool {

namespace {

[[noreturn]] void report_missing(std::string_view purpose, std::string_view path, std::string_view package) {
#ifdef ABSENC_PARTS_LEFT_OUT
  throw Failure(
      fmt::format("{} is not in this build of absenc, nor is the package {}: {} says what was left out and why",
                  purpose, package, ABSENC_PARTS_LEFT_OUT));
#endif
  throw Failure(fmt::format("{} is a part of absenc that is not installed: {} is not there. Install the package {}",
                            purpose, path, package));
}

}  // namespace

std::string path_of_part(std::string_view name) {
  return os::folder_of_program() + "/../lib/absenc/" + std::string(name);
}

void start_program(const Subcommand& subcommand, std::span<char* const> words) {
  const std::string path = path_of_part(subcommand.program);
  if (!os::is_file(path)) report_missing(fmt::format("`absenc {}`", subcommand.name), path, subcommand.package);
  os::become_program(path, "absenc", words);
}

void load_hdf5() {
  const std::string path = path_of_part(hdf5_plugin);
  if (!os::is_file(path)) report_missing("writing HDF5", path, hdf5_package);
  const auto* plugin = static_cast<const Hdf5Plugin*>(os::load_symbol(path, hdf5_plugin_symbol));
  if (plugin->build != build_text()) {
    throw Failure(fmt::format("{} is of absenc {}, but this is absenc {}: install the same version of absenc and {}",
                              path, plugin->build, build_text(), hdf5_package));
  }
  client::set_hdf5_file_maker(plugin->make);
}

}  // namespace absenc::tool
