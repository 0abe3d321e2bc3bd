// SPDX-License-Identifier: Apache-2.0
// The plug-in by which the command writes HDF5, so that the command itself does not link it.
#include "tools/hdf5/plugin.hpp"

#include "absenc/client/hdf5/hdf5_record.hpp"
#include "tools/absenc/version.hpp"

extern "C" {
[[gnu::visibility("default")]] extern const absenc::tool::Hdf5Plugin absenc_hdf5_plugin;
const absenc::tool::Hdf5Plugin absenc_hdf5_plugin{absenc::tool::build_text(), &absenc::client::make_hdf5_file};
}
