// SPDX-License-Identifier: Apache-2.0
// What was, in one SQLite file: each second's least, mean and greatest of every encoder, and what happened to them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/os/kept_file.hpp"
#include "absenc/serve/happening.hpp"
#include "absenc/serve/watch.hpp"

namespace absenc::serve {

struct HistoryLimits {
  std::int64_t seconds = 30LL * 24 * 3600;    // what is older is deleted
  std::int64_t bytes = 1024LL * 1024 * 1024;  // beyond it, the oldest is deleted
};

/// Written by one thread. What was written before a loss of power or kill -9 stays, but for the last second.
class HistoryWriter {
 public:
  /// Throws Failure when the file cannot be opened, or is something else.
  HistoryWriter(std::string path, const HistoryLimits& limits);
  ~HistoryWriter();
  HistoryWriter(const HistoryWriter&) = delete;
  HistoryWriter& operator=(const HistoryWriter&) = delete;

  struct Entry {
    std::string encoder;
    Second second;
  };
  /// All of it or, when the disk is full, nothing: what was lost is counted, and told in the history as soon as it can
  /// be. Returns whether it was written.
  bool write(const std::vector<Entry>& seconds, const std::vector<Happening>& happenings);
  /// Deletes what is beyond the limits; cheap when there is nothing.
  void trim();

  /// Why the last `write` failed; "" when it did not.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

 private:
  struct Database;
  void note_loss(std::size_t rows, const std::string& why);

  std::unique_ptr<os::KeptFile> lock_;  // until the database is closed
  std::unique_ptr<Database> database_;
  HistoryLimits limits_;
  std::string trouble_;
  std::uint64_t lost_ = 0;
  std::uint64_t lost_now_ = 0;  // since it was last told
  std::int64_t lost_since_ms_ = 0;
};

/// Calendar times in seconds, both included.
struct Range {
  std::int64_t from_s = 0;
  std::int64_t to_s = 0;
};

/// Reads beside the writer; one thread.
class HistoryReader {
 public:
  /// Throws Failure.
  explicit HistoryReader(const std::string& path);
  ~HistoryReader();
  HistoryReader(const HistoryReader&) = delete;
  HistoryReader& operator=(const HistoryReader&) = delete;

  /// At most `most` rows, each of as many seconds as that takes: [[at_s, least, mean, greatest, speed least, mean,
  /// greatest, readings, errors],...]
  [[nodiscard]] client::Json seconds(const std::string& encoder, Range range, std::int64_t most);
  /// The newest `most` of an encoder, "": of all.
  [[nodiscard]] client::Json happenings(const std::string& encoder, Range range, std::int64_t most);
  /// Up to `most` rows of CSV, with where the next begin: behind `range.to_s` when there are no more.
  [[nodiscard]] std::pair<std::string, std::int64_t> csv(const std::string& encoder, Range range, std::int64_t most);
  [[nodiscard]] static std::string_view csv_header();

 private:
  struct Database;
  std::unique_ptr<Database> database_;
};

}  // namespace absenc::serve
