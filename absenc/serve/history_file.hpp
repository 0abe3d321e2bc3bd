// SPDX-License-Identifier: Apache-2.0
// The history file while it is open for writing, which other programs may move or damage.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absenc/os/owned_file.hpp"
#include "absenc/serve/sqlite.hpp"

namespace absenc::serve {

/// Thrown when another server writes to the same history file.
struct HistoryInUse : client::Failure {
  using client::Failure::Failure;
};

class HistoryFile {
 public:
  /// Opens the file, or creates it. Throws HistoryInUse, DamagedFile, client::Failure, os::Failure.
  explicit HistoryFile(const std::string& path);

  [[nodiscard]] Sqlite& sqlite() { return *sqlite_; }

  enum class State : std::uint8_t {
    whole,
    changed,  // another program changed the file, which is still intact
    gone,
    replaced,
    damaged,
  };
  /// Returns how the file at the path differs from its state at the last `note_written`.
  [[nodiscard]] State check() const;
  /// Stores the modification time of the history file. Call it after each transaction.
  void note_written();

  /// Closes a history file in state `changed`, without a change of the file or of its write-ahead log.
  void close();
  /// Closes a history file in state `gone` or `replaced`. Removes its write-ahead log, or renames the log if SQLite
  /// cannot write it into the database file.
  void close_moved();
  /// Renames and closes a damaged history file. Returns its new name. Throws Failure.
  std::string set_aside();
  /// Renames the history file at `path` and its write-ahead log. Returns the new name of the file. Throws Failure.
  static std::string set_aside(const std::string& path);

 private:
  [[nodiscard]] bool is_truncated() const;
  [[nodiscard]] bool passes_quick_check() const;

  std::string path_;
  // The history file, opened a second time beside SQLite. Closing it before the database would release SQLite's locks.
  std::unique_ptr<os::OwnedFile> owned_file_;
  std::optional<Sqlite> sqlite_;
  os::FileIdentity log_;    // identity of the write-ahead log of SQLite
  os::FileIdentity index_;  // identity of the index of the write-ahead log
  std::int64_t modified_ns_ = 0;
};

}  // namespace absenc::serve
