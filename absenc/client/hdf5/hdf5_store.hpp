// SPDX-License-Identifier: Apache-2.0
// Stores an HDF5 file that can be opened after a crash at any point after the first commit.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "absenc/core/bytes.hpp"

namespace absenc::client {

class Hdf5Store {
 public:
  struct Disk {
    std::function<void(std::uint64_t size)> grow;
    std::function<void(std::uint64_t at, Bytes bytes)> write;
    std::function<void(std::uint64_t at, MutableBytes bytes)> read;
  };
  explicit Hdf5Store(Disk disk) : disk_(std::move(disk)) {}

  /// Makes this store the driver of files that are opened with the property list `access`; the store must outlive them.
  void attach(hid_t access);

  /// Writes the stored blocks to the disk. Throws the exceptions of `disk`.
  void commit();

  // Functions that the HDF5 driver calls:
  void write(H5FD_mem_t type, std::uint64_t at, Bytes bytes);
  void read(std::uint64_t at, MutableBytes bytes);

  std::uint64_t end = 0;  // end of the space that the HDF5 library has allocated, as an offset in the file

 private:
  struct StoredBlock {
    H5FD_mem_t type;
    std::vector<std::uint8_t> bytes;
  };
  [[nodiscard]] static int rank(const StoredBlock& block);

  Disk disk_;
  std::map<std::uint64_t, StoredBlock> blocks_;
  std::uint64_t committed_end_ = 0;
};

}  // namespace absenc::client
