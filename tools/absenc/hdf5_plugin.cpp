// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "absenc/client/recording/record_file.hpp"
#include "absenc/os/program.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parts.hpp"
#include "tools/absenc/version.hpp"
#include "tools/hdf5/plugin.hpp"

namespace absenc::tool {

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
