// SPDX-License-Identifier: Apache-2.0
// Stores an HDF5 file so that it can be opened if the process crashes at any point after the first commit. The store
// collects the writes of the HDF5 library; `commit` writes them in an order in which the file is consistent after every
// single write.
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

  /// Sets this store as the driver in `access`, a property list for H5Fcreate. The store must outlive the file.
  void attach(hid_t access);

  /// Writes the collected blocks to the disk. Throws the exceptions of `disk`; then the data committed before remains
  /// intact.
  void commit();

  // Functions for the HDF5 driver:
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
