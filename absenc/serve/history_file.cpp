// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/history_file.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <filesystem>
#include <system_error>

#include "absenc/os/file_name.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr std::int64_t version = 1;

constexpr const char* schema = R"(
CREATE TABLE IF NOT EXISTS encoder (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);
CREATE TABLE IF NOT EXISTS second (
  encoder INTEGER NOT NULL, at INTEGER NOT NULL, readings INTEGER NOT NULL, errors INTEGER NOT NULL,
  least REAL, mean REAL, greatest REAL, speed_least REAL, speed_mean REAL, speed_greatest REAL,
  PRIMARY KEY (encoder, at)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS happening (
  id INTEGER PRIMARY KEY, at_ms INTEGER NOT NULL, encoder TEXT NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL,
  who TEXT NOT NULL);
CREATE INDEX IF NOT EXISTS happening_at ON happening (at_ms);
)";

std::string log_of(const std::string& path) { return path + "-wal"; }
std::string index_of(const std::string& path) { return path + "-shm"; }

std::unique_ptr<os::OwnedFile> lock(const std::string& path) {
  try {
    return std::make_unique<os::OwnedFile>(path);
  } catch (const os::Failure& failure) {
    if (failure.kind() != os::Failure::Kind::in_use) throw Failure(fmt::format("the history: {}", failure.what()));
    throw HistoryInUse(fmt::format(
        "another server keeps its history in {}: end it, or give this one a file of its own with --history", path));
  }
}

void remove_if_same(const std::string& path, const os::FileIdentity& identity) {
  std::error_code ignored;
  if (identity.number != 0 && os::identity_of(path) == identity) std::filesystem::remove(os::path_of(path), ignored);
}

void rename_to(const std::string& path, const std::string& name) {
  std::error_code error;
  std::filesystem::rename(os::path_of(path), os::path_of(name), error);
  if (error) throw Failure(fmt::format("the history {} cannot be renamed to {}: {}", path, name, error.message()));
}

std::string new_name_beside(const std::string& path) {
  const std::string name = fmt::format("{}.damaged-{:%Y%m%dT%H%M%SZ}", path, fmt::gmtime(std::time(nullptr)));
  std::string free_name = name;
  for (int i = 2; os::identity_of(free_name).number != 0; ++i) free_name = fmt::format("{}-{}", name, i);
  return free_name;
}

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char byte : bytes) value = value << 8 | static_cast<unsigned char>(byte);
  return value;
}

}  // namespace

HistoryFile::HistoryFile(const std::string& path) : path_(path), owned_file_(lock(path)) {
  sqlite_.emplace("the history", path, Sqlite::For::writing);
  // With a write-ahead log, committed rows survive a kill, and other programs can read the history while it is
  // written.
  sqlite_->run("PRAGMA auto_vacuum = INCREMENTAL; PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL");
  const std::int64_t found = sqlite_->number("PRAGMA user_version");
  if (found > version) throw Failure(fmt::format("the history {} was written by a newer absenc", path));
  sqlite_->run(schema);
  sqlite_->run(fmt::format("PRAGMA user_version = {}", version));
  log_ = os::identity_of(log_of(path));
  index_ = os::identity_of(index_of(path));
  // After kill -9 the database file has its full length only after its write-ahead log was written into it.
  const bool is_in_file = sqlite_->number("PRAGMA wal_checkpoint(FULL)") == 0;
  if (is_in_file && is_truncated()) throw DamagedFile(fmt::format("the history {} was cut off", path));
  note_written();
}

// Returns whether the file is cut off, by its header (https://www.sqlite.org/fileformat.html, 1.3).
bool HistoryFile::is_truncated() const {
  constexpr std::string_view magic{"SQLite format 3\0", 16};
  const std::string header = owned_file_->beginning(32);
  if (header.size() < 32 || !header.starts_with(magic)) return true;
  const std::uint32_t written = big_endian(header.substr(16, 2));
  const std::int64_t page = written == 1 ? 65536 : written;
  return owned_file_->state().size < page * std::int64_t{big_endian(header.substr(28, 4))};
}

// Returns whether SQLite finds the database file intact; reads it anew through a separate connection.
bool HistoryFile::passes_quick_check() const {
  if (owned_file_->state().size == 0) return false;  // an empty database file is damaged; SQLite would delete its log
  try {
    Sqlite other("the history", path_, Sqlite::For::reading);
    Statement quick_check(other, "PRAGMA quick_check(1)");
    return quick_check.next() && quick_check.text(0) == "ok";
  } catch (const DamagedFile&) {
    return false;
  }
}

HistoryFile::State HistoryFile::check() const {
  if (!owned_file_->has_its_name()) {
    return os::identity_of(path_).number == 0 ? State::gone : State::replaced;
  }
  // A different modification time can mean that another program has changed the file.
  const bool is_changed = owned_file_->state().modified_ns != modified_ns_;
  if (!is_changed && !is_truncated()) return State::whole;
  if (!passes_quick_check()) return State::damaged;
  return is_changed ? State::changed : State::whole;
}

void HistoryFile::note_written() { modified_ns_ = owned_file_->state().modified_ns; }

void HistoryFile::close() {
  sqlite_->keep_log_on_close();
  sqlite_.reset();
  owned_file_.reset();
}

void HistoryFile::close_moved() {
  bool is_in_file = false;
  try {
    is_in_file = sqlite_->number("PRAGMA wal_checkpoint(FULL)") == 0;
  } catch (const Failure&) {  // the write-ahead log was not written into the database file, so the log is renamed below
  }
  close();
  // If the write-ahead log stayed at its path, SQLite would apply it to the next history file there.
  if (is_in_file) {
    remove_if_same(log_of(path_), log_);
  } else if (os::identity_of(log_of(path_)) == log_ && log_.number != 0) {
    rename_to(log_of(path_), new_name_beside(path_) + ".wal");
  }
  remove_if_same(index_of(path_), index_);
}

std::string HistoryFile::set_aside() {
  sqlite_->keep_log_on_close();
  sqlite_.reset();  // on Windows, SQLite's open files cannot be renamed
  std::string name = set_aside(path_);
  remove_if_same(index_of(path_), index_);
  owned_file_.reset();
  return name;
}

// The write-ahead log is renamed, too: under its old name, SQLite would write it into the next history file there.
std::string HistoryFile::set_aside(const std::string& path) {
  std::string name = new_name_beside(path);
  rename_to(path, name);
  if (os::identity_of(log_of(path)).number != 0) rename_to(log_of(path), name + ".wal");
  return name;
}

}  // namespace absenc::serve
