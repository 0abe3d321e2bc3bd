// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/spool.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "absenc/client/error.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr std::int64_t spool_version = 1;
constexpr std::int64_t bytes_of_a_row = 32;         // beside its texts
constexpr std::int64_t pages_worth_freeing = 1000;  // of 4096 bytes: after a broker was away for long

// AUTOINCREMENT: an id is never given again, however much was removed.
constexpr const char* spool_schema = R"(
CREATE TABLE IF NOT EXISTS message (
  id INTEGER PRIMARY KEY AUTOINCREMENT, topic TEXT NOT NULL, payload TEXT NOT NULL, readings INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS encoder (name TEXT PRIMARY KEY, next INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS source (id TEXT NOT NULL);
INSERT INTO source SELECT lower(hex(randomblob(8))) WHERE NOT EXISTS (SELECT * FROM source);
)";

std::int64_t size_of(std::size_t topic, std::size_t payload) {
  return static_cast<std::int64_t>(topic + payload) + bytes_of_a_row;
}

}  // namespace

Spool::Spool(const std::string& path, std::int64_t bytes)
    : sqlite_("the spool", path, Sqlite::For::writing), most_bytes_(bytes) {
  // Two servers that send the same would be told apart by nobody: the file is locked while it is open.
  sqlite_.run("PRAGMA locking_mode = EXCLUSIVE; PRAGMA auto_vacuum = INCREMENTAL; PRAGMA journal_mode = WAL");
  sqlite_.run("PRAGMA synchronous = NORMAL");
  if (sqlite_.number("PRAGMA user_version") > spool_version) {
    throw Failure(fmt::format("the spool {} was written by a newer absenc", path));
  }
  sqlite_.run(spool_schema);
  sqlite_.run(fmt::format("PRAGMA user_version = {}", spool_version));
  Statement names(sqlite_, "SELECT id, lower(hex(randomblob(8))) FROM source");
  if (names.next()) {
    source_ = names.text(0);
    run_ = names.text(1);
  }
  Statement held(sqlite_,
                 "SELECT count(*), ifnull(sum(readings), 0), "
                 "ifnull(sum(length(CAST(topic AS BLOB)) + length(CAST(payload AS BLOB))), 0) FROM message");
  if (!held.next()) return;
  held_.counts = {static_cast<std::uint64_t>(held.integer(0)), static_cast<std::uint64_t>(held.integer(1))};
  held_.bytes = held.integer(2) + held.integer(0) * bytes_of_a_row;
}

template <class Work>
void Spool::commit(const Work& work) {
  try {
    sqlite_.run("BEGIN IMMEDIATE");
    work();
    sqlite_.run("COMMIT");
  } catch (const Failure&) {
    try {
      if (sqlite_.in_transaction()) sqlite_.run("ROLLBACK");
    } catch (const Failure&) {  // then it has ended by itself
    }
    throw;
  }
}

std::map<std::string, std::uint64_t> Spool::next_numbers() {
  const std::lock_guard lock(mutex_);
  std::map<std::string, std::uint64_t> all;
  Statement rows(sqlite_, "SELECT name, next FROM encoder");
  while (rows.next()) all[rows.text(0)] = static_cast<std::uint64_t>(rows.integer(1));
  return all;
}

std::int64_t Spool::next_id() {
  const std::lock_guard lock(mutex_);
  return sqlite_.number("SELECT ifnull(max(seq), 0) + 1 FROM sqlite_sequence WHERE name = 'message'");
}

Spool::Counts Spool::add(const std::vector<Message>& messages,
                         const std::map<std::string, std::uint64_t>& next_numbers) {
  const std::lock_guard lock(mutex_);
  Held after = held_;
  Held dropped;
  commit([&] {
    Statement insert(sqlite_, "INSERT INTO message (id, topic, payload, readings) VALUES (?, ?, ?, ?)");
    for (const Message& one : messages) {
      insert.bind(1, one.id).bind(2, one.topic).bind(3, one.payload);
      insert.bind(4, static_cast<std::int64_t>(one.readings)).run();
      ++after.counts.messages;
      after.counts.readings += one.readings;
      after.bytes += size_of(one.topic.size(), one.payload.size());
    }
    Statement number(sqlite_, "INSERT OR REPLACE INTO encoder (name, next) VALUES (?, ?)");
    for (const auto& [name, next] : next_numbers) number.bind(1, name).bind(2, static_cast<std::int64_t>(next)).run();
    if (after.bytes > most_bytes_) dropped = drop_oldest(after.bytes - most_bytes_);
  });
  after.counts.messages -= dropped.counts.messages;
  after.counts.readings -= dropped.counts.readings;
  after.bytes -= dropped.bytes;
  hold(after);
  return dropped.counts;
}

Spool::Held Spool::drop_oldest(std::int64_t bytes) {
  Held dropped;
  std::int64_t last = 0;
  Statement rows(sqlite_,
                 "SELECT id, readings, length(CAST(topic AS BLOB)) + length(CAST(payload AS BLOB)) FROM message "
                 "ORDER BY id");
  while (dropped.bytes < bytes && rows.next()) {
    last = rows.integer(0);
    ++dropped.counts.messages;
    dropped.counts.readings += static_cast<std::uint64_t>(rows.integer(1));
    dropped.bytes += rows.integer(2) + bytes_of_a_row;
  }
  rows.reset();
  Statement(sqlite_, "DELETE FROM message WHERE id <= ?").bind(1, last).run();
  return dropped;
}

std::vector<Message> Spool::after(std::int64_t id, std::size_t most) {
  const std::lock_guard lock(mutex_);
  std::vector<Message> found;
  Statement rows(sqlite_, "SELECT id, topic, payload, readings FROM message WHERE id > ? ORDER BY id LIMIT ?");
  rows.bind(1, id).bind(2, static_cast<std::int64_t>(most));
  while (rows.next()) {
    found.push_back({rows.integer(0), rows.text(1), rows.text(2), static_cast<std::uint64_t>(rows.integer(3))});
  }
  return found;
}

void Spool::remove(const std::vector<std::int64_t>& ids) {
  const std::lock_guard lock(mutex_);
  Held after = held_;
  commit([&] {
    Statement remove(sqlite_,
                     "DELETE FROM message WHERE id = ? RETURNING readings, "
                     "length(CAST(topic AS BLOB)) + length(CAST(payload AS BLOB))");
    for (const std::int64_t id : ids) {
      remove.bind(1, id);
      while (remove.next()) {  // unless it was dropped meanwhile
        --after.counts.messages;
        after.counts.readings -= static_cast<std::uint64_t>(remove.integer(0));
        after.bytes -= remove.integer(1) + bytes_of_a_row;
      }
    }
  });
  hold(after);
  if (held_.counts.messages != 0 || sqlite_.number("PRAGMA freelist_count") < pages_worth_freeing) return;
  sqlite_.run("PRAGMA incremental_vacuum");
}

void Spool::forget(const std::string& encoder) {
  const std::lock_guard lock(mutex_);
  Statement(sqlite_, "DELETE FROM encoder WHERE name = ?").bind(1, encoder).run();
}

void Spool::hold(const Held& now) {
  const std::lock_guard lock(held_mutex_);
  held_ = now;
}

Spool::Counts Spool::held() const {
  const std::lock_guard lock(held_mutex_);
  return held_.counts;
}

std::int64_t Spool::held_bytes() const {
  const std::lock_guard lock(held_mutex_);
  return held_.bytes;
}

}  // namespace absenc::serve
