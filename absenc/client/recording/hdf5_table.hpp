// SPDX-License-Identifier: Apache-2.0
// Writes rows as an HDF5 file with one dataset for each column, except columns that are details.
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

/// Rows of a recording, converted to the format of an HDF5 file.
class Hdf5Rows {
 public:
  explicit Hdf5Rows(std::span<const Column> columns);

  void add(const Row& row);
  [[nodiscard]] std::uint64_t count() const { return count_; }
  void clear();

 private:
  friend class Hdf5Table;
  std::vector<std::size_t> columns_;  // for each column of the file, the index of its value in a row
  std::vector<ColumnType> types_;
  std::vector<std::vector<std::uint8_t>> elements_;
  std::uint64_t count_ = 0;
};

using Hdf5Attributes = std::vector<std::pair<std::string, std::variant<std::string, double, std::uint64_t>>>;

/// Value of the attribute `rows` while the recording is not finished.
constexpr std::uint64_t hdf5_not_ended = UINT64_MAX;

class Hdf5Table {
 public:
  /// Writes an empty table with these attributes. Throws Failure and the exceptions of `disk`.
  Hdf5Table(Hdf5Store::Disk disk, std::span<const Column> columns, const Hdf5Attributes& attributes);
  ~Hdf5Table();
  Hdf5Table(const Hdf5Table&) = delete;
  Hdf5Table& operator=(const Hdf5Table&) = delete;

  /// Appends the rows to the file. Throws Failure and the exceptions of `disk`.
  void commit(const Hdf5Rows& rows);
  /// Stores the number of rows in the attribute `rows`. Throws Failure and the exceptions of `disk`.
  void finish();

 private:
  void make(const Column& column);

  Hdf5Store store_;
  hid_t file_ = H5I_INVALID_HID;
  std::vector<hid_t> datasets_;
  std::uint64_t rows_ = 0;
};

}  // namespace absenc::client
