// SPDX-License-Identifier: Apache-2.0
// In place of tools/absenc/hdf5_plugin.cpp where the command is one file, which contains HDF5.
#include "absenc/client/hdf5/hdf5_record.hpp"
#include "tools/absenc/parts.hpp"

namespace absenc::tool {

void load_hdf5() { client::set_hdf5_file_maker(&client::make_hdf5_file); }

}  // namespace absenc::tool
