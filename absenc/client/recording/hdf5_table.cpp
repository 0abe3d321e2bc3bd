// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/recording/hdf5_table.hpp"

#include <algorithm>
#include <limits>
#include <mutex>
#include <type_traits>

#include "absenc/client/error.hpp"

namespace absenc::client {

namespace {

constexpr hsize_t rows_of_a_chunk = 1024;
// alignment of objects in the file, in bytes: a write inside one page is assumed to be atomic
constexpr hsize_t page = 4096;
constexpr std::size_t text_bytes = 48;  // length of text columns in bytes, which is longer than the name of any error

// Lock for all calls of the HDF5 library, which may be built without thread safety.
std::mutex& library() {
  static std::mutex mutex;
  return mutex;
}

void require(herr_t result) {
  if (result < 0) throw Failure("HDF5 could not go on writing: record to a name that ends in .csv");
}

/// Owner of an HDF5 identifier, which it releases.
class Handle {
 public:
  using Release = herr_t (*)(hid_t);
  Handle(hid_t id, Release release) : id_(id), release_(release) { require(id_ < 0 ? -1 : 0); }
  ~Handle() { release_(id_); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }  // implicit conversion, because HDF5 functions take hid_t

 private:
  hid_t id_;
  Release release_;
};

Handle hdf5_type(ColumnType type) {
  const auto made = [&] {
    switch (type) {
      case ColumnType::int64:
        return H5Tcopy(H5T_STD_I64LE);
      case ColumnType::uint64:
        return H5Tcopy(H5T_STD_U64LE);
      case ColumnType::real:
        return H5Tcopy(H5T_IEEE_F64LE);
      case ColumnType::boolean:
        return H5Tcopy(H5T_STD_I8LE);
      case ColumnType::flags:
        return H5Tcopy(H5T_STD_U32LE);
      case ColumnType::text:
      case ColumnType::bytes:
        break;
    }
    const hid_t text = H5Tcopy(H5T_C_S1);
    require(H5Tset_size(text, text_bytes));
    require(H5Tset_strpad(text, H5T_STR_NULLPAD));
    require(H5Tset_cset(text, H5T_CSET_UTF8));
    return text;
  };
  return {made(), H5Tclose};
}

using Elements = std::vector<std::uint8_t>;

template <class T>
void append(Elements& elements, T value) {
  // The bytes are copied as they are: the file is little endian, and the host must be so, too.
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(&value);
  elements.insert(elements.end(), bytes, bytes + sizeof value);
}

void append_text(Elements& elements, std::string_view text) {
  const std::size_t end = elements.size() + text_bytes;
  const std::string_view kept = text.substr(0, text_bytes);
  elements.insert(elements.end(), kept.begin(), kept.end());
  elements.resize(end);
}

// Appends the element that stands for a missing value in a column of this type.
void append_missing(Elements& elements, ColumnType type) {
  switch (type) {
    case ColumnType::int64:
      return append(elements, std::numeric_limits<std::int64_t>::min());
    case ColumnType::uint64:
      return append(elements, std::numeric_limits<std::uint64_t>::max());
    case ColumnType::real:
      return append(elements, std::numeric_limits<double>::quiet_NaN());
    case ColumnType::boolean:
      return append(elements, std::int8_t{-1});
    case ColumnType::flags:
      return append(elements, std::numeric_limits<std::uint32_t>::max());
    case ColumnType::text:
    case ColumnType::bytes:
      break;
  }
  append_text(elements, {});
}

void append_value(Elements& elements, ColumnType type, const Value& value) {
  if (type == ColumnType::text || type == ColumnType::bytes) return append_text(elements, to_text(value));
  const auto put = [&](const auto& one) {
    using One = std::decay_t<decltype(one)>;
    if constexpr (std::is_same_v<One, bool>) {
      append(elements, static_cast<std::int8_t>(one));
    } else if constexpr (std::is_arithmetic_v<One>) {
      append(elements, one);
    } else if constexpr (std::is_same_v<One, Flags>) {
      append(elements, one.bits);
    } else {
      append_missing(elements, type);
    }
  };
  std::visit(put, value);
}

void put_attribute(hid_t object, const std::string& name, hid_t type, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  require(H5Awrite(attribute, type, value));
}

void put_attribute(hid_t object, const std::string& name, const std::string& text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  require(H5Tset_size(type, text.size() + 1));
  require(H5Tset_cset(type, H5T_CSET_UTF8));
  put_attribute(object, name, type, text.c_str());
}
void put_attribute(hid_t object, const std::string& name, double number) {
  put_attribute(object, name, H5T_IEEE_F64LE, &number);
}
void put_attribute(hid_t object, const std::string& name, std::uint64_t number) {
  put_attribute(object, name, H5T_STD_U64LE, &number);
}

constexpr const char* rows_name = "rows";

}  // namespace

Hdf5Rows::Hdf5Rows(std::span<const Column> columns) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].presentation.is_detail) continue;
    columns_.push_back(i);
    types_.push_back(columns[i].type);
  }
  elements_.resize(columns_.size());
}

void Hdf5Rows::add(const Row& row) {
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    append_value(elements_[i], types_[i], row.values[columns_[i]]);
  }
  ++count_;
}

void Hdf5Rows::clear() {
  for (std::vector<std::uint8_t>& column : elements_) column.clear();
  count_ = 0;
}

Hdf5Table::Hdf5Table(Hdf5Store::Disk disk, std::span<const Column> columns, const Hdf5Attributes& attributes)
    : store_(std::move(disk)) {
  const std::lock_guard lock(library());
  // the library must print no errors, because absenc reports them itself
  require(H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr));
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  store_.attach(access);
  // Selects the oldest file format of HDF5, because it has no checksums over several blocks.
  require(H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18));
  require(H5Pset_meta_block_size(access, 0));
  require(H5Pset_alignment(access, 1, page));
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  file_ = H5Fcreate("recording", H5F_ACC_TRUNC, creation, access);
  require(file_ < 0 ? -1 : 0);
  for (const auto& [name, value] : attributes) {
    std::visit([&, &key = name](const auto& one) { put_attribute(file_, key, one); }, value);
  }
  put_attribute(file_, rows_name, hdf5_not_ended);
  std::string names;
  for (const Column& column : columns) {
    if (column.presentation.is_detail) continue;
    make(column);
    names += (names.empty() ? "" : ",") + std::string(column.name);
  }
  // stores the names of the columns in their order, because the oldest HDF5 file format does not store the order
  put_attribute(file_, "columns", names);
  require(H5Fflush(file_, H5F_SCOPE_GLOBAL));
  store_.commit();
}

Hdf5Table::~Hdf5Table() {
  const std::lock_guard lock(library());
  for (const hid_t dataset : datasets_) H5Dclose(dataset);
  // the last writes of the library are not committed: the file is complete without them
  if (file_ >= 0) H5Fclose(file_);
}

void Hdf5Table::make(const Column& column) {
  const Handle type = hdf5_type(column.type);
  Elements nothing;
  append_missing(nothing, column.type);
  constexpr hsize_t none = 0;
  constexpr hsize_t any = H5S_UNLIMITED;
  const Handle space(H5Screate_simple(1, &none, &any), H5Sclose);
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  require(H5Pset_chunk(creation, 1, &rows_of_a_chunk));
  require(H5Pset_fill_value(creation, type, nothing.data()));
  require(H5Pset_obj_track_times(creation, false));
  const hid_t dataset =
      H5Dcreate2(file_, std::string(column.name).c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
  require(dataset < 0 ? -1 : 0);
  datasets_.push_back(dataset);
  if (!column.unit.empty()) put_attribute(dataset, "unit", std::string(column.unit));
  if (!column.meaning.empty()) put_attribute(dataset, "meaning", std::string(column.meaning));
  put_attribute(dataset, "missing_value", type, nothing.data());
}

void Hdf5Table::commit(const Hdf5Rows& rows) {
  if (rows.count() == 0) return;
  const std::lock_guard lock(library());
  const hsize_t count = rows.count();
  const hsize_t before = rows_;
  const hsize_t after = before + count;
  const Handle memory(H5Screate_simple(1, &count, nullptr), H5Sclose);
  for (std::size_t i = 0; i < datasets_.size(); ++i) {
    const Handle type = hdf5_type(rows.types_[i]);
    require(H5Dset_extent(datasets_[i], &after));
    const Handle space(H5Dget_space(datasets_[i]), H5Sclose);
    require(H5Sselect_hyperslab(space, H5S_SELECT_SET, &before, nullptr, &count, nullptr));
    require(H5Dwrite(datasets_[i], type, memory, space, H5P_DEFAULT, rows.elements_[i].data()));
  }
  require(H5Fflush(file_, H5F_SCOPE_GLOBAL));
  store_.commit();
  rows_ = after;
}

void Hdf5Table::finish() {
  const std::lock_guard lock(library());
  {
    const Handle attribute(H5Aopen(file_, rows_name, H5P_DEFAULT), H5Aclose);
    require(H5Awrite(attribute, H5T_NATIVE_UINT64, &rows_));
  }
  require(H5Fflush(file_, H5F_SCOPE_GLOBAL));
  store_.commit();
}

}  // namespace absenc::client
