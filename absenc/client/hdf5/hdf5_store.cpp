// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/hdf5/hdf5_store.hpp"

#include <algorithm>
#include <cstring>
#include <iterator>

#include "absenc/client/error.hpp"

namespace absenc::client {

namespace {

struct DriverFile {
  H5FD_t common;  // first member, so that a pointer to it can be cast to a pointer to the struct
  Hdf5Store* store;
};

Hdf5Store& store_of(const H5FD_t* file) { return *reinterpret_cast<const DriverFile*>(file)->store; }

H5FD_t* open_file(const char*, unsigned, hid_t access, haddr_t) {
  const auto* info = static_cast<Hdf5Store* const*>(H5Pget_driver_info(access));
  return info == nullptr ? nullptr : &(new DriverFile{{}, *info})->common;
}

herr_t close_file(H5FD_t* file) {
  delete reinterpret_cast<DriverFile*>(file);
  return 0;
}

// Reports no features of the driver: with some, the HDF5 library would combine blocks of several types.
herr_t query(const H5FD_t*, unsigned long* features) {
  *features = 0;
  return 0;
}

haddr_t allocated(const H5FD_t* file, H5FD_mem_t) { return store_of(file).end; }

herr_t allocate(H5FD_t* file, H5FD_mem_t, haddr_t end) {
  store_of(file).end = end;
  return 0;
}

herr_t read(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t at, std::size_t size, void* buffer) {
  try {
    store_of(file).read(at, {static_cast<std::uint8_t*>(buffer), size});
    return 0;
  } catch (...) {  // C code calls this function, so no exception may leave it
    return -1;
  }
}

herr_t write(H5FD_t* file, H5FD_mem_t type, hid_t, haddr_t at, std::size_t size, const void* buffer) {
  try {
    store_of(file).write(type, at, {static_cast<const std::uint8_t*>(buffer), size});
    return 0;
  } catch (...) {
    return -1;
  }
}

const H5FD_class_t& driver_class() {
  static const H5FD_class_t driver = [] {
    H5FD_class_t made{};
    made.name = "absenc";
    made.maxaddr = INT64_MAX;
    made.fc_degree = H5F_CLOSE_STRONG;
    made.fapl_size = sizeof(Hdf5Store*);
    made.open = open_file;
    made.close = close_file;
    made.query = query;
    made.get_eoa = allocated;
    made.set_eoa = allocate;
    made.get_eof = allocated;
    made.read = read;
    made.write = write;
    // The HDF5 library keeps separate lists of free space for metadata and raw data.
    const H5FD_mem_t types[] = H5FD_FLMAP_DICHOTOMY;
    std::copy(std::begin(types), std::end(types), std::begin(made.fl_map));
    return made;
  }();
  return driver;
}

// offset of the byte with the node's level in a B-tree node of version 1, which begins with "TREE", type and level
constexpr std::size_t level_of_node = 5;

}  // namespace

void Hdf5Store::attach(hid_t access) {
  static const hid_t driver = H5FDregister(&driver_class());
  Hdf5Store* self = this;
  if (driver < 0 || H5Pset_driver(access, driver, &self) < 0) throw Failure("HDF5 takes no driver");
}

void Hdf5Store::write(H5FD_mem_t type, std::uint64_t at, Bytes bytes) {
  // The HDF5 library writes whole objects. So if a new block overlaps an older one, one of the two should contain the
  // other.
  auto next = blocks_.upper_bound(at);
  if (next != blocks_.begin()) {
    auto& [begin, block] = *std::prev(next);
    if (at + bytes.size() <= begin + block.bytes.size()) {
      std::copy(bytes.begin(), bytes.end(), block.bytes.begin() + static_cast<std::ptrdiff_t>(at - begin));
      return;
    }
    if (begin != at && begin + block.bytes.size() > at) throw Failure("HDF5 writes blocks that overlap");
  }
  for (next = blocks_.lower_bound(at); next != blocks_.end() && next->first < at + bytes.size();) {
    if (next->first + next->second.bytes.size() > at + bytes.size()) throw Failure("HDF5 writes blocks that overlap");
    next = blocks_.erase(next);
  }
  blocks_[at] = {type, {bytes.begin(), bytes.end()}};
}

void Hdf5Store::read(std::uint64_t at, MutableBytes bytes) {
  disk_.read(at, bytes);
  auto one = blocks_.upper_bound(at);
  if (one != blocks_.begin()) --one;
  for (; one != blocks_.end() && one->first < at + bytes.size(); ++one) {
    const std::uint64_t from = std::max(at, one->first);
    const std::uint64_t to = std::min(at + bytes.size(), one->first + one->second.bytes.size());
    if (from >= to) continue;
    const auto place = static_cast<std::size_t>(from - at);
    const auto within = static_cast<std::size_t>(from - one->first);
    std::memcpy(&bytes[place], &one->second.bytes[within], static_cast<std::size_t>(to - from));
  }
}

// Returns the rank of a block in the order in which changed blocks are rewritten: the lowest rank comes first.
int Hdf5Store::rank(const StoredBlock& block) {
  constexpr int last = 1000;
  switch (block.type) {
    case H5FD_MEM_SUPER:
      return 0;
    case H5FD_MEM_DRAW:
      return 1;
    case H5FD_MEM_BTREE:
      return last - 1 - (block.bytes.size() > level_of_node ? block.bytes[level_of_node] : 0);
    case H5FD_MEM_OHDR:
      return last;
    default:
      return 2;
  }
}

void Hdf5Store::commit() {
  using Entry = std::pair<const std::uint64_t, StoredBlock>;
  std::vector<const Entry*> again;
  // Writes new blocks before changed ones: readers cannot see new blocks until the changed ones are written.
  for (const Entry& one : blocks_) {
    if (one.first < committed_end_) {
      again.push_back(&one);
    } else {
      disk_.write(one.first, one.second.bytes);
    }
  }
  disk_.grow(end);
  std::stable_sort(again.begin(), again.end(), [](const Entry* a, const Entry* b) {
    const int rank_a = rank(a->second);
    const int rank_b = rank(b->second);
    return rank_a != rank_b ? rank_a < rank_b : a->first > b->first;
  });
  for (const Entry* one : again) disk_.write(one->first, one->second.bytes);
  blocks_.clear();
  committed_end_ = end;
}

}  // namespace absenc::client
