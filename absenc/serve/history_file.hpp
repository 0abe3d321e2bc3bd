// SPDX-License-Identifier: Apache-2.0
// The file of a history while it is written. Others may move, remove, replace, overwrite or truncate it meanwhile;
// SQLite would go on writing to what has no name any more, or mix its log into another file.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absenc/os/owned_file.hpp"
#include "absenc/serve/sqlite.hpp"

namespace absenc::serve {

/// Another server keeps it.
struct HistoryInUse : client::Failure {
  using client::Failure::Failure;
};

class HistoryFile {
 public:
  /// Makes it where there is none. Throws HistoryInUse, DamagedFile, Failure.
  explicit HistoryFile(const std::string& path);

  [[nodiscard]] Sqlite& sqlite() { return *sqlite_; }

  enum class State : std::uint8_t {
    whole,
    changed,  // by another program, and whole
    gone,
    replaced,
    damaged,
  };
  /// Compares the file at the path with the one that `note_written` saw.
  [[nodiscard]] State look() const;
  /// After each transaction: who else writes to the file is known by the time of its change.
  void note_written();

  /// Closes a `changed` file as it is, with its log.
  void close();
  /// Closes a file that is `gone` or `replaced`: it has everything that was written, wherever it is, and its log no
  /// longer stands beside the path.
  void leave();
  /// Closes a `damaged` file and renames it. Returns its new name. Throws Failure.
  std::string set_aside();
  /// Renames what stands at `path`. Returns the new name. Throws Failure.
  static std::string set_aside(const std::string& path);

 private:
  [[nodiscard]] bool is_shorter_than_it_says() const;
  [[nodiscard]] bool is_sound() const;

  std::string path_;
  std::unique_ptr<os::OwnedFile> kept_;  // until the database is closed: closing it would undo SQLite's locks
  std::optional<Sqlite> sqlite_;
  os::FileIdentity log_;  // the write-ahead log and its index
  os::FileIdentity index_;
  std::int64_t modified_ns_ = 0;
};

}  // namespace absenc::serve
