// SPDX-License-Identifier: Apache-2.0
// Files of readings, for hours: a header, then a line for each reading and for each thing that went wrong. Each line is
// handed to the system at once, whole or not at all, so that nothing is lost when the process is killed.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absenc/client/encoder.hpp"
#include "absenc/client/sample_rows.hpp"

namespace absenc::os {
class LineFile;
}

namespace absenc::client {

struct RecordingSettings {
  std::string path;                // ending in .csv; in .jsonl or .ndjson for JSON lines. There is no such file yet
  std::string encoder;             // what the header calls it
  double rate_hz = 100;            // readings a second that are intended; 0: as many as can be
  std::uint64_t every = 1;         // of so many readings one is written, and each with other alarms than the one before
  std::uint64_t count = 0;         // written readings after which it ends; 0: without end
  std::optional<Time> duration{};  // after which it ends
  std::optional<std::uint64_t> part_bytes{};  // after which another file is begun
  std::optional<Time> part_time{};            // after which another file is begun
};

/// With parts, the files are NAME-0001.csv, NAME-0002.csv ...; each has the header and can be read alone.
class Recording {
 public:
  /// Makes the first file, of readings of `encoder`, which must outlive it. Throws UsageError, and os::Failure, also
  /// when there is a file of that name already.
  Recording(const RecordingSettings& settings, Encoder& encoder);
  ~Recording();

  /// Reads and writes until the settings end it, or Encoder::cancel, or an interrupt does; then waits for the disk.
  /// `heard` is called with each sample once it is written. When the port is lost it waits for it to come back; both
  /// are lines, and so are readings that were due and could not be taken. Returns whether the last sample was a
  /// reading. Throws os::Failure: the disk, and `lost` when the file was removed or replaced; UsageError, Failure.
  bool run(const std::function<void(const Sample&)>& heard = {});

  [[nodiscard]] std::uint64_t readings() const { return readings_; }  // written
  [[nodiscard]] std::uint64_t failures() const { return failures_; }  // written: attempts to read
  [[nodiscard]] std::uint64_t gaps() const { return gaps_; }          // written
  [[nodiscard]] std::uint64_t missed() const { return missed_; }      // readings, in these gaps
  [[nodiscard]] std::uint64_t bytes() const;
  [[nodiscard]] Time start() const { return start_; }  // of os::now
  /// "log.csv", or "log-0001.csv to log-0003.csv"
  [[nodiscard]] std::string names() const;

 private:
  enum class Format : std::uint8_t { csv, json_lines };

  [[nodiscard]] std::string part_path(unsigned part) const;
  void refuse_parts_of_another_recording() const;
  void open_part();
  [[nodiscard]] std::string header() const;
  [[nodiscard]] std::string line_of(const Row& row) const;
  [[nodiscard]] bool wanted(const Sample& sample);
  void take(const Sample& sample);
  void miss(std::uint64_t readings);
  void write_gap();

  RecordingSettings settings_;
  Encoder& encoder_;
  Format format_;
  Time start_;
  SampleRows rows_;
  std::string started_;  // the same as date and time
  std::unique_ptr<os::LineFile> file_;
  unsigned part_ = 0;
  Time part_start_{};
  std::uint64_t finished_bytes_ = 0;
  std::uint64_t seen_ = 0;
  std::uint64_t readings_ = 0;
  std::uint64_t failures_ = 0;
  std::uint64_t gaps_ = 0;
  std::uint64_t missed_ = 0;
  std::uint64_t gap_ = 0;  // missed, and not written yet
  Time gap_at_{};
  std::uint32_t alarms_ = 0;
};

}  // namespace absenc::client
