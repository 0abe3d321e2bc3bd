// SPDX-License-Identifier: Apache-2.0
// Rows as an HDF5 file: one dataset for each column, which h5py, MATLAB and h5dump read.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absenc/client/recording/hdf5_store.hpp"
#include "absenc/client/row.hpp"

namespace absenc::client {

/// Elements of some rows, column by column, as they stand in the file. Details are left out.
class Hdf5Rows {
 public:
  explicit Hdf5Rows(std::span<const Column> columns);

  void add(const Row& row);
  [[nodiscard]] std::uint64_t count() const { return count_; }
  void clear();

 private:
  friend class Hdf5Table;
  std::vector<std::size_t> columns_;  // which of those of a row
  std::vector<Type> types_;
  std::vector<std::vector<std::uint8_t>> elements_;
  std::uint64_t count_ = 0;
};

using Hdf5Attributes = std::vector<std::pair<std::string, std::variant<std::string, double, std::uint64_t>>>;

/// In the attribute `rows` of a file that is still written, or whose writer was killed.
constexpr std::uint64_t hdf5_not_ended = UINT64_MAX;

class Hdf5Table {
 public:
  /// `attributes`: of the file, which has `columns` too, their names. Columns have `unit`, `meaning`, and
  /// `missing_value`: what stands where nothing was told, NaN of reals. Throws Failure, and what `disk` throws.
  Hdf5Table(Hdf5Store::Disk disk, std::span<const Column> columns, const Hdf5Attributes& attributes);
  ~Hdf5Table();
  Hdf5Table(const Hdf5Table&) = delete;
  Hdf5Table& operator=(const Hdf5Table&) = delete;

  /// Afterwards they are in the file. Throws as the constructor: then those of before are.
  void commit(const Hdf5Rows& rows);
  /// Sets the attribute `rows` of the file, which is `hdf5_not_ended` until then. Throws as `commit`.
  void finish();

 private:
  void make(const Column& column);

  Hdf5Store store_;
  hid_t file_ = H5I_INVALID_HID;
  std::vector<hid_t> datasets_;
  std::uint64_t rows_ = 0;
};

}  // namespace absenc::client
