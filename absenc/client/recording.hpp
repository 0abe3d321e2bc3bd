// SPDX-License-Identifier: Apache-2.0
// Files of readings, for hours: a header, then a row for each reading and for each thing that went wrong. A line is
// handed to the system at once, whole or not at all, so that nothing is lost when the process is killed; rows of HDF5
// within a second.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/encoder.hpp"
#include "absenc/client/record_counts.hpp"

namespace absenc::client {

/// Where a recording goes, and what of the readings is kept.
struct RecordingSettings {
  std::string path;         ///< ending in .csv; .jsonl or .ndjson: JSON lines; .h5: HDF5. There is no such file yet
  std::string encoder;      ///< what the header calls it
  double rate_hz = 100;     ///< readings a second that are intended; 0: as many as can be
  std::uint64_t every = 1;  ///< of so many readings one is written, and each with other alarms than the one before
  std::uint64_t count = 0;  ///< written readings after which it ends; 0: without end
  std::optional<Time> duration{};             ///< after which it ends
  std::optional<std::uint64_t> part_bytes{};  ///< after which another file is begun
  std::optional<Time> part_time{};            ///< after which another file is begun
};

/// With parts, the files are NAME-0001.csv, NAME-0002.csv ...; each has the header and can be read alone.
class Recording {
 public:
  /// Makes the first file, of readings of `encoder`, which must outlive it. Throws UsageError, and os::Failure, also
  /// when there is a file of that name already.
  Recording(const RecordingSettings& settings, Encoder& encoder);
  ~Recording();

  /// Reads and writes until the settings end it, or Encoder::cancel, end_when, or an interrupt does; then waits for the
  /// disk. `on_written` is called with each sample after its row was written. When the port is lost it waits for it to
  /// come back; both are lines, and so are readings that were due and could not be taken. Returns whether the last
  /// sample was a reading. Throws os::Failure: the disk, and `lost` when the file was removed or replaced; UsageError,
  /// Failure.
  bool run(const std::function<void(const Sample&)>& on_written = {});

  /// Of what is in the files.
  [[nodiscard]] RecordCounts counts() const;
  /// Returns the number of bytes written so far.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Returns when the recording began, in time of os::now.
  [[nodiscard]] Time start() const;
  /// The file, or its parts so far in their order.
  [[nodiscard]] std::vector<std::string> paths() const;
  /// "log.csv", or "log-0001.csv to log-0003.csv"
  [[nodiscard]] std::string names() const;

 private:
  struct Parts;

  std::unique_ptr<Parts> parts_;
};

}  // namespace absenc::client
