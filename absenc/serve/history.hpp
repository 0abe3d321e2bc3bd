// SPDX-License-Identifier: Apache-2.0
// The history of `absenc serve` in one SQLite file: values of each second of the encoders, and events.
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
  // Age in seconds above which rows and events are deleted, but only if a whole day of newer rows exists.
  std::int64_t seconds = 30LL * 24 * 3600;
  // size in bytes of the used part of the file above which the oldest rows are deleted
  std::int64_t bytes = 1024LL * 1024 * 1024;
};

/// A range of calendar times in seconds, both ends included.
struct Range {
  std::int64_t from_s = 0;
  std::int64_t to_s = 0;
};

/// A reader of the history, for use while HistoryWriter writes it. Thread-safe.
class HistoryReader {
 public:
  /// Opens no file: the queries open it, and throw Failure if that is impossible.
  explicit HistoryReader(std::string path);
  ~HistoryReader();
  HistoryReader(const HistoryReader&) = delete;
  HistoryReader& operator=(const HistoryReader&) = delete;

  /// Returns the object {"encoder","step_s","rows"} with at most `most` rows, each for `step_s` seconds: [[at_s,
  /// least, mean and greatest position, least, mean and greatest speed, number of readings, number of errors],...]
  [[nodiscard]] client::Json seconds(const std::string& encoder, Range range, std::int64_t most);
  /// Returns at most `most` events of `encoder` in `range`, the newest first; `encoder` "": all events.
  [[nodiscard]] client::Json server_events(const std::string& encoder, Range range, std::int64_t most);
  /// Returns up to `most` rows as CSV, and the calendar second from which the next call must read the rows that
  /// follow: `range.to_s` + 1 if no rows follow in the range.
  [[nodiscard]] std::pair<std::string, std::int64_t> csv(const std::string& encoder, Range range, std::int64_t most);
  [[nodiscard]] static std::string_view csv_header();

 private:
  friend class HistoryWriter;
  /// Closes the history file. Until `accept` is called, each query throws Failure with the text `why`.
  void refuse(const std::string& why);
  void accept();
  Sqlite& database();

  std::string path_;
  std::mutex mutex_;  // mutex that guards all members below
  std::optional<Sqlite> database_;
  std::string refused_;
};

/// The writer of the history, used by one thread. A power failure can lose written rows; kill -9 does not.
class HistoryWriter {
 public:
  /// Throws HistoryInUse when another server writes to the file. Other errors are not thrown; `trouble` returns them.
  HistoryWriter(std::string path, const HistoryLimits& limits);
  ~HistoryWriter();
  HistoryWriter(const HistoryWriter&) = delete;
  HistoryWriter& operator=(const HistoryWriter&) = delete;

  struct Entry {
    std::string encoder;
    Second second;
  };
  /// Writes all rows and events that were handed over, or counts them as lost.
  void write(const std::vector<Entry>& seconds, const std::vector<ServerEvent>& server_events);
  /// Deletes old rows and events, by the limits of age and size.
  void trim();

  /// Returns the error because of which the history is not being written; "" if the last `write` has succeeded.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  /// Returns sentences about changes of the history file and about lost rows since the last call.
  [[nodiscard]] std::vector<std::string> take_notes();
  [[nodiscard]] HistoryReader& reader() { return reader_; }

 private:
  void open();
  void require_file();
  void close_file(HistoryFile::State state);
  void set_aside(std::string_view why);
  void insert(const std::vector<Entry>& seconds, const std::vector<ServerEvent>& server_events);
  void note_loss(std::size_t rows, const std::string& why);
  void roll_back();
  [[nodiscard]] bool has_day_of_rows_since(std::int64_t at_s);
  [[nodiscard]] std::int64_t end_of_oldest_tenth();
  void delete_before(std::int64_t at_s);

  std::string path_;
  HistoryReader reader_;
  std::optional<HistoryFile> file_;
  bool was_open_ = false;
  HistoryLimits limits_;
  std::string trouble_;
  std::uint64_t lost_ = 0;
  std::uint64_t unreported_losses_ = 0;  // number of lost rows and events that no text in `notes_` reports yet
  std::int64_t lost_since_ms_ = 0;
  std::vector<std::string> notes_;
};

}  // namespace absenc::serve
