// SPDX-License-Identifier: Apache-2.0
// One file of a recording, in any of its formats.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/record_counts.hpp"
#include "absenc/client/row.hpp"

namespace absenc::client {

/// The data in the header of each file of a recording.
struct RecordHeader {
  std::string encoder;
  std::string protocol;
  std::string model;
  std::string options;
  std::string started;
  double rate_hz = 0;
  std::uint64_t every = 1;
  std::uint64_t part = 1;
};

/// One file of a recording. Functions that write, and `require_there`, throw os::Failure, Failure.
class RecordFile {
 public:
  virtual ~RecordFile() = default;

  /// Appends a row, and adds `counts` to the counts of the file.
  virtual void append(const Row& row, const RecordCounts& counts) = 0;
  /// Waits until all appended rows are in the file and on the disk.
  virtual void sync() = 0;
  /// Ends the file; nothing may be appended afterwards.
  virtual void finish() = 0;
  virtual void require_there() const = 0;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Returns the counts of the rows that are in the file.
  [[nodiscard]] virtual RecordCounts counts() const = 0;
};

enum class RecordForm : std::uint8_t { csv, json_lines, hdf5 };

/// Returns the format that the ending of the file name selects. Throws UsageError.
[[nodiscard]] RecordForm record_form(const std::string& path);

/// Creates a file, which must not exist, with its header. `columns` must outlive the result.
[[nodiscard]] std::unique_ptr<RecordFile> make_record_file(const std::string& path, std::span<const Column> columns,
                                                           const RecordHeader& header);

/// Creates a file as `make_record_file` does, but only as CSV or JSON lines.
[[nodiscard]] std::unique_ptr<RecordFile> make_text_file(const std::string& path, RecordForm form,
                                                         std::span<const Column> columns, const RecordHeader& header);

/// Creates a file as `make_record_file` does, but only as HDF5.
using Hdf5FileMaker = std::unique_ptr<RecordFile> (*)(const std::string& path, std::span<const Column> columns,
                                                      const RecordHeader& header);
/// Sets the function by which this program creates HDF5 files; without one, HDF5 is refused. Call it before threads are
/// started.
void set_hdf5_file_maker(Hdf5FileMaker maker);

}  // namespace absenc::client
