// SPDX-License-Identifier: Apache-2.0
// What was, in one SQLite file: each second's least, mean and greatest of every encoder, and what happened to them.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/serve/history_file.hpp"
#include "absenc/serve/server_event.hpp"
#include "absenc/serve/watch.hpp"

namespace absenc::serve {

struct HistoryLimits {
  std::int64_t seconds = 30LL * 24 * 3600;    // what is older is deleted
  std::int64_t bytes = 1024LL * 1024 * 1024;  // beyond it, the oldest is deleted
};

/// Calendar times in seconds, both included.
struct Range {
  std::int64_t from_s = 0;
  std::int64_t to_s = 0;
};

/// Reads beside the writer, from any thread.
class HistoryReader {
 public:
  /// Each question throws Failure where there is no history at `path`.
  explicit HistoryReader(std::string path);
  ~HistoryReader();
  HistoryReader(const HistoryReader&) = delete;
  HistoryReader& operator=(const HistoryReader&) = delete;

  /// At most `most` rows, each of as many seconds as that takes: [[at_s, least, mean, greatest, speed least, mean,
  /// greatest, readings, errors],...]
  [[nodiscard]] client::Json seconds(const std::string& encoder, Range range, std::int64_t most);
  /// The newest `most` of an encoder, "": of all.
  [[nodiscard]] client::Json server_events(const std::string& encoder, Range range, std::int64_t most);
  /// Up to `most` rows of CSV, with where the next begin: behind `range.to_s` when there are no more.
  [[nodiscard]] std::pair<std::string, std::int64_t> csv(const std::string& encoder, Range range, std::int64_t most);
  [[nodiscard]] static std::string_view csv_header();

 private:
  friend class HistoryWriter;
  /// Closes the file, so that the writer can change to another at the path: with its old log and index, SQLite would
  /// read neither. Until `accept` each question throws Failure, with `why`.
  void refuse(const std::string& why);
  void accept();
  Sqlite& database();

  std::string path_;
  std::mutex mutex_;  // guards what follows
  std::optional<Sqlite> database_;
  std::string refused_;
};

/// Written by one thread. What was written before a loss of power or kill -9 stays, but for the last second.
class HistoryWriter {
 public:
  /// Throws HistoryInUse when another server keeps the file. Whatever else is wrong with it is its trouble, and it is
  /// tried again with each `write`.
  HistoryWriter(std::string path, const HistoryLimits& limits);
  ~HistoryWriter();
  HistoryWriter(const HistoryWriter&) = delete;
  HistoryWriter& operator=(const HistoryWriter&) = delete;

  struct Entry {
    std::string encoder;
    Second second;
  };
  /// All of it or, when the disk is full, nothing: what was lost is counted. Begins anew where the file was moved,
  /// removed, replaced, truncated or damaged; a damaged one is kept under another name.
  void write(const std::vector<Entry>& seconds, const std::vector<ServerEvent>& server_events);
  /// Deletes what is beyond the limits; cheap when there is nothing. By its age only once a day was recorded since.
  void trim();

  /// Why the last `write` failed; "" when it did not.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  /// Sentences about what happened to the history since the last call.
  [[nodiscard]] std::vector<std::string> take_notes();
  [[nodiscard]] HistoryReader& reader() { return reader_; }

 private:
  void open();
  void require_file();
  void leave(HistoryFile::State state);
  void set_aside(std::string_view why);
  void insert(const std::vector<Entry>& seconds, const std::vector<ServerEvent>& server_events);
  void note_loss(std::size_t rows, const std::string& why);
  void roll_back();
  [[nodiscard]] bool was_recorded_since(std::int64_t at_s);
  [[nodiscard]] std::int64_t end_of_oldest_tenth();
  void delete_before(std::int64_t at_s);

  std::string path_;
  HistoryReader reader_;
  std::optional<HistoryFile> file_;
  bool was_open_ = false;
  HistoryLimits limits_;
  std::string trouble_;
  std::uint64_t lost_ = 0;
  std::uint64_t lost_now_ = 0;  // since it was last told
  std::int64_t lost_since_ms_ = 0;
  std::vector<std::string> notes_;
};

}  // namespace absenc::serve
