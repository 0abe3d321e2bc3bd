// SPDX-License-Identifier: Apache-2.0
// One file of a recording, whatever its form.
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

/// What a file begins with.
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

/// All throw os::Failure: the disk, and `lost` when the file was removed or replaced.
class RecordFile {
 public:
  virtual ~RecordFile() = default;

  /// It is in the file within a second.
  virtual void append(const Row& row, const RecordCounts& counts) = 0;
  /// Waits until all is in the file and on the disk.
  virtual void sync() = 0;
  /// Says in the file how many rows it has, so that a reader knows that none is missing, and syncs. Nothing is appended
  /// afterwards.
  virtual void finish() = 0;
  virtual void require_there() const = 0;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Of what is in the file.
  [[nodiscard]] virtual RecordCounts counts() const = 0;
};

enum class RecordForm : std::uint8_t { csv, json_lines, hdf5 };

/// By the ending of the name; throws UsageError.
[[nodiscard]] RecordForm record_form(const std::string& path);

/// Makes the file, which must not exist, with its header. `columns` outlive it.
[[nodiscard]] std::unique_ptr<RecordFile> make_record_file(const std::string& path, std::span<const Column> columns,
                                                           const RecordHeader& header);

// How they are made.
[[nodiscard]] std::unique_ptr<RecordFile> make_text_file(const std::string& path, RecordForm form,
                                                         std::span<const Column> columns, const RecordHeader& header);
[[nodiscard]] std::unique_ptr<RecordFile> make_hdf5_file(const std::string& path, std::span<const Column> columns,
                                                         const RecordHeader& header);

}  // namespace absenc::client
