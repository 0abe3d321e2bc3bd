// SPDX-License-Identifier: Apache-2.0
// Checks that a file keeps its committed rows in a crash.
#include "absenc/client/hdf5/hdf5_table.hpp"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>

#include "absenc/client/test_support.hpp"
#include "absenc/os/line_file.hpp"

namespace absenc::client {
namespace {

namespace fs = std::filesystem;

constexpr std::array<Column, 3> columns{{{"time_s", "s", ColumnType::real, "seconds"},
                                         {"position", "counts", ColumnType::int64, ""},
                                         {"event", "", ColumnType::text, ""}}};

struct Write {
  std::uint64_t at;
  // bytes that are written to the file at the offset `at`; empty: the file grows to the size `at`
  std::vector<std::uint8_t> bytes;
};

struct Bench {
  explicit Bench(const char* name) : path(own_path(name) + ".h5"), file(path) {}
  ~Bench() { fs::remove(path); }

  [[nodiscard]] Hdf5Store::Disk disk() {
    return {.grow =
                [this](std::uint64_t size) {
                  writes.push_back({size, {}});
                },
            .write =
                [this](std::uint64_t at, Bytes bytes) {
                  writes.push_back({at, {bytes.begin(), bytes.end()}});
                },
            .read = [this](std::uint64_t at, MutableBytes bytes) { file.read(at, bytes); }};
  }
  void apply(const Write& write) {
    if (write.bytes.empty()) {
      file.grow(write.at);
    } else {
      file.write(write.at, write.bytes);
    }
  }

  fs::path path;
  os::BlockFile file;
  std::vector<Write> writes;
};

Hdf5Rows rows_from(std::int64_t first, std::int64_t count) {
  Hdf5Rows rows(columns);
  for (std::int64_t i = first; i < first + count; ++i) {
    rows.add({columns, {static_cast<double>(i) / 8, i, std::string(i % 7 == 0 ? "gap" : "")}});
  }
  return rows;
}

/// Returns the number of rows in a dataset; -1 if the dataset cannot be read or has wrong values.
template <class T>
std::int64_t whole_rows(const fs::path& path, const char* name, hid_t type, T (*expected)(std::int64_t)) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file < 0) return -1;
  const hid_t dataset = H5Dopen2(file, name, H5P_DEFAULT);
  std::int64_t found = -1;
  if (dataset >= 0) {
    const hid_t space = H5Dget_space(dataset);
    std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
    H5Sclose(space);
    found = static_cast<std::int64_t>(values.size());
    if (found > 0 && H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) found = -1;
    for (std::int64_t i = 0; i < found; ++i) {
      if (values[static_cast<std::size_t>(i)] != expected(i)) found = -1;
    }
    H5Dclose(dataset);
  }
  H5Fclose(file);
  return found;
}

// The rows are too many for one B-tree node, so that nodes are split.
TEST(Hdf5Table, EveryBeginningOfACommitIsAWholeFile) {
  Bench bench("prefix");
  Hdf5Table table(bench.disk(), columns, {{"encoder", std::string("elbow")}, {"rate_hz", 100.0}});
  for (const Write& one : std::exchange(bench.writes, {})) bench.apply(one);
  bench.file.appear();
  constexpr std::int64_t batch = 7'001;
  std::int64_t committed = 0;
  std::size_t states = 0;
  while (committed < 14 * batch) {
    table.commit(rows_from(committed, batch));
    for (const Write& one : std::exchange(bench.writes, {})) {
      bench.apply(one);
      ++states;
      const std::int64_t positions =
          whole_rows<std::int64_t>(bench.path, "position", H5T_NATIVE_INT64, [](std::int64_t i) { return i; });
      const std::int64_t times = whole_rows<double>(bench.path, "time_s", H5T_NATIVE_DOUBLE,
                                                    [](std::int64_t i) { return static_cast<double>(i) / 8; });
      ASSERT_GE(positions, committed) << "state " << states;
      ASSERT_GE(times, committed) << "state " << states;
      ASSERT_LE(times, positions) << "state " << states << ": what has a time has all";
    }
    committed += batch;
    ASSERT_EQ(whole_rows<double>(bench.path, "time_s", H5T_NATIVE_DOUBLE,
                                 [](std::int64_t i) { return static_cast<double>(i) / 8; }),
              committed);
  }
  EXPECT_GT(states, 200u);
}

// If the disk is full at any write, the rows that were committed before this write must remain.
TEST(Hdf5Table, AWriteThatFailsLosesOnlyItsCommit) {
  for (int failing = 0;; ++failing) {
    ASSERT_LT(failing, 1000);
    Bench bench("full");
    int left = -1;
    Hdf5Store::Disk disk{.grow = [&](std::uint64_t size) { bench.file.grow(size); },
                         .write =
                             [&](std::uint64_t at, Bytes bytes) {
                               if (left == 0) throw std::runtime_error("full");
                               if (left > 0) --left;
                               bench.file.write(at, bytes);
                             },
                         .read = [&](std::uint64_t at, MutableBytes bytes) { bench.file.read(at, bytes); }};
    Hdf5Table table(disk, columns, {});
    bench.file.appear();
    table.commit(rows_from(0, 900));
    left = failing;
    bool failed = false;
    try {
      table.commit(rows_from(900, 5000));
    } catch (const std::runtime_error&) {
      failed = true;
    }
    const std::int64_t rows =
        whole_rows<std::int64_t>(bench.path, "position", H5T_NATIVE_INT64, [](std::int64_t i) { return i; });
    EXPECT_GE(rows, 900) << failing;
    if (failed) continue;
    EXPECT_EQ(rows, 5900) << failing;
    return;  // all writes succeeded, so each of them has been tested as the one that fails
  }
}

}  // namespace
}  // namespace absenc::client
