// SPDX-License-Identifier: Apache-2.0
// The interface between the command and its plug-in for HDF5, which are always of the same build.
#pragma once

#include <string_view>

#include "absenc/client/recording/record_file.hpp"

namespace absenc::tool {

struct Hdf5Plugin {
  std::string_view build;      // version and commit of the plug-in
  client::Hdf5FileMaker make;  // creates a recording
};

/// Name of the plug-in's only symbol, a Hdf5Plugin.
inline constexpr const char* hdf5_plugin_symbol = "absenc_hdf5_plugin";

}  // namespace absenc::tool
