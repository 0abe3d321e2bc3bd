// SPDX-License-Identifier: Apache-2.0
// The files that `absenc record` writes: a header, then a line for each reading and for each thing that went wrong.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absenc/client/encoder.hpp"
#include "absenc/client/sample_rows.hpp"
#include "absenc/client/way/connection.hpp"
#include "absenc/os/line_file.hpp"

namespace absenc::tool {

using namespace client;

struct RecordingSettings {
  std::string path;                        // ending in .csv, .jsonl or .ndjson
  std::string encoder;                     // as the user wrote it
  double rate = 0;                         // readings a second that are intended; 0: as many as can be
  std::uint64_t every = 1;                 // of so many readings one is written
  std::optional<std::uint64_t> part_size;  // bytes after which another file is begun
  std::optional<Time> part_time;           // time after which another file is begun
};

/// With parts, the files are NAME-0001.csv, NAME-0002.csv ...; each has the header and can be read alone.
class Recording {
 public:
  /// Makes the first file. Throws UsageError and os::Failure, also when there is a file of that name already.
  Recording(const RecordingSettings& settings, const EncoderAddress& uri);

  /// Writes a line at once, whole or not at all. Throws os::Failure.
  void take(const Sample& sample);
  /// So many readings were due and were not taken: a line of its own, before the next that is written.
  void miss(std::uint64_t readings);
  /// Waits for the disk. Throws os::Failure.
  void finish();

  [[nodiscard]] std::uint64_t readings() const { return readings_; }  // written
  [[nodiscard]] std::uint64_t failures() const { return failures_; }  // written: attempts to read
  [[nodiscard]] std::uint64_t gaps() const { return gaps_; }          // written
  [[nodiscard]] std::uint64_t missed() const { return missed_; }      // readings, in these gaps
  [[nodiscard]] std::uint64_t bytes() const { return finished_bytes_ + file_->size(); }
  [[nodiscard]] Time start() const { return start_; }
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
  void write_gap();

  RecordingSettings settings_;
  const Unit* unit_;
  Options options_;
  Format format_;
  Time start_;
  SampleRows rows_;
  std::string started_;  // the same as date and time
  std::optional<os::LineFile> file_;
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

}  // namespace absenc::tool
