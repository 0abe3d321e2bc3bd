// SPDX-License-Identifier: Apache-2.0
// Creates recordings in HDF5.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "absenc/client/recording/record_file.hpp"

namespace absenc::client {

/// Creates a file, which must not exist, with its header. `columns` must outlive the result.
[[nodiscard]] std::unique_ptr<RecordFile> make_hdf5_file(const std::string& path, std::span<const Column> columns,
                                                         const RecordHeader& header);

}  // namespace absenc::client
