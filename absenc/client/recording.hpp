// SPDX-License-Identifier: Apache-2.0
// Writes long recordings: files with a header and rows for readings, failures and events.
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

/// File, rate, and length of a recording, and the limits of its parts.
struct RecordingSettings {
  /// Path of a new file, which ends in .csv, .jsonl, .ndjson, .h5 or .hdf5.
  std::string path;
  std::string encoder;   ///< Name of the encoder, as the header of the file shows it.
  double rate_hz = 100;  ///< Intended number of readings per second; 0: as many as possible.
  /// Writes every Nth reading, and each reading whose alarms differ from those of the reading before; 1: writes all
  /// readings.
  std::uint64_t every = 1;
  std::uint64_t count = 0;         ///< Number of written readings after which the recording ends; 0: no limit.
  std::optional<Time> duration{};  ///< Time after which the recording ends; without a value: no limit.
  /// Size in bytes after which the next part begins; without a value: no limit.
  std::optional<std::uint64_t> part_bytes{};
  std::optional<Time> part_time{};  ///< Time after which the next part begins; without a value: no limit.
};

/// A recording in progress. Parts of log.csv are log-0001.csv, log-0002.csv and so on.
class Recording {
 public:
  /// Creates the first file, for readings of `encoder`, which must outlive this object. Throws UsageError, Failure,
  /// os::Failure.
  Recording(const RecordingSettings& settings, Encoder& encoder);
  ~Recording();

  /// Reads and writes until the settings, Encoder::cancel, end_when or an interrupt end the recording. Calls
  /// `on_written` with each sample. Returns whether the last sample was a reading. Throws UsageError, Failure,
  /// os::Failure.
  bool run(const std::function<void(const Sample&)>& on_written = {});

  /// Returns the counts of the rows in all files.
  [[nodiscard]] RecordCounts counts() const;
  /// Returns the number of bytes that were written to all files so far.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Returns the time of os::now at which the recording began.
  [[nodiscard]] Time start() const;
  /// Returns the path of the file, or the paths of the parts so far, in their order.
  [[nodiscard]] std::vector<std::string> paths() const;
  /// Returns the paths of the files as text: "log.csv", or "log-0001.csv to log-0003.csv".
  [[nodiscard]] std::string names() const;

 private:
  struct Parts;

  std::unique_ptr<Parts> parts_;
};

}  // namespace absenc::client
