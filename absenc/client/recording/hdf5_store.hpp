// SPDX-License-Identifier: Apache-2.0
// Where the HDF5 library puts a file whose every state on disk can be opened: what it writes is collected, and reaches
// the file by `commit` in an order of which every beginning is a whole file.
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

  /// Makes `access`, a list of properties for H5Fcreate, lead here. The store outlives the file.
  void attach(hid_t access);

  /// Throws what `disk` throws: then what was committed before is still whole, and nothing more can be committed.
  void commit();

  // For the driver.
  void write(H5FD_mem_t type, std::uint64_t at, Bytes bytes);
  void read(std::uint64_t at, MutableBytes bytes);

  std::uint64_t end = 0;  // of what the library has allocated

 private:
  struct Block {
    H5FD_mem_t type;
    std::vector<std::uint8_t> bytes;
  };
  [[nodiscard]] static int rank(const Block& block);

  Disk disk_;
  std::map<std::uint64_t, Block> blocks_;
  std::uint64_t committed_end_ = 0;
};

}  // namespace absenc::client
