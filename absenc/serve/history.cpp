// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/serve/sqlite.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr std::int64_t version = 1;

// A write-ahead log keeps what was committed when the process is killed, and lets others read meanwhile.
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

// A second comes twice when the clock was set back, or the server began anew within it: it has the readings of both.
constexpr const char* add_second = R"(
INSERT INTO second SELECT id, ?, ?, ?, ?, ?, ?, ?, ?, ? FROM encoder WHERE name = ?
ON CONFLICT (encoder, at) DO UPDATE SET
  readings = readings + excluded.readings, errors = errors + excluded.errors,
  least = coalesce(min(least, excluded.least), least, excluded.least),
  greatest = coalesce(max(greatest, excluded.greatest), greatest, excluded.greatest),
  mean = coalesce((mean * readings + excluded.mean * excluded.readings) / (readings + excluded.readings),
                  mean, excluded.mean),
  speed_least = coalesce(min(speed_least, excluded.speed_least), speed_least, excluded.speed_least),
  speed_greatest = coalesce(max(speed_greatest, excluded.speed_greatest), speed_greatest, excluded.speed_greatest),
  speed_mean = coalesce((speed_mean * readings + excluded.speed_mean * excluded.readings)
                        / (readings + excluded.readings), speed_mean, excluded.speed_mean)
)";

void bind_spread(Statement& statement, int first, const Spread& spread) {
  if (spread.count == 0) {
    for (int i = 0; i < 3; ++i) statement.bind_null(first + i);
    return;
  }
  statement.bind(first, spread.least).bind(first + 1, spread.mean()).bind(first + 2, spread.greatest);
}

Json real_or_null(const Statement& row, int column) { return row.is_null(column) ? Json() : Json(row.real(column)); }

std::string csv_real(const Statement& row, int column) {
  return row.is_null(column) ? std::string() : fmt::format("{}", row.real(column));
}

std::string csv_text(std::string_view text) {
  if (text.find_first_of(",\"\n\r") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

}  // namespace

struct HistoryWriter::Database {
  explicit Database(const std::string& path) : sqlite("the history", path, Sqlite::For::writing) {
    sqlite.run("PRAGMA auto_vacuum = INCREMENTAL; PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL");
    const std::int64_t found = sqlite.number("PRAGMA user_version");
    if (found > version) throw Failure(fmt::format("the history {} was written by a newer absenc", path));
    sqlite.run(schema);
    sqlite.run(fmt::format("PRAGMA user_version = {}", version));
  }

  void roll_back() {
    try {
      if (sqlite.in_transaction()) sqlite.run("ROLLBACK");
    } catch (const Failure&) {  // then it has ended by itself
    }
  }

  Sqlite sqlite;
};

namespace {

// Two servers would write the same seconds. What else is wrong with the file SQLite says.
std::unique_ptr<os::KeptFile> lock(const std::string& path) {
  try {
    return std::make_unique<os::KeptFile>(path);
  } catch (const os::Failure& failure) {
    if (failure.kind() != os::Failure::Kind::in_use) return nullptr;
    throw Failure(fmt::format(
        "another server keeps its history in {}: end it, or give this one a file of its own with --history", path));
  }
}

}  // namespace

HistoryWriter::HistoryWriter(std::string path, const HistoryLimits& limits)
    : lock_(lock(path)), database_(std::make_unique<Database>(path)), limits_(limits) {
  // A clock that is not set yet, or wrong, would make all of it old.
  const std::int64_t newest =
      database_->sqlite.number("SELECT ifnull(max((SELECT max(at) FROM second WHERE encoder = id)), 0) FROM encoder");
  if (calendar_ms() / 1000 - newest < 24 * 3600) trim();
}
HistoryWriter::~HistoryWriter() = default;

bool HistoryWriter::write(const std::vector<Entry>& seconds, const std::vector<Happening>& happenings) {
  Sqlite& sqlite = database_->sqlite;
  try {
    sqlite.run("BEGIN IMMEDIATE");
    Statement name(sqlite, "INSERT OR IGNORE INTO encoder (name) VALUES (?)");
    Statement second(sqlite, add_second);
    for (const Entry& entry : seconds) {
      name.bind(1, entry.encoder).run();
      second.bind(1, entry.second.at_s).bind(2, static_cast<std::int64_t>(entry.second.readings));
      second.bind(3, static_cast<std::int64_t>(entry.second.errors));
      bind_spread(second, 4, entry.second.place);
      bind_spread(second, 7, entry.second.speed);
      second.bind(10, entry.encoder).run();
    }
    Statement happening(sqlite, "INSERT INTO happening (at_ms, encoder, kind, text, who) VALUES (?, ?, ?, ?, ?)");
    const auto tell = [&](const Happening& one) {
      happening.bind(1, one.at_ms).bind(2, one.encoder).bind(3, one.kind).bind(4, one.text).bind(5, one.who).run();
    };
    for (const Happening& one : happenings) tell(one);
    if (lost_now_ != 0) {
      tell({calendar_ms(), "", "history",
            fmt::format("{} rows since {} could not be written: {}", lost_now_, lost_since_ms_ / 1000, trouble_)});
    }
    sqlite.run("COMMIT");
    lost_now_ = 0;
    trouble_.clear();
    return true;
  } catch (const Failure& failure) {
    note_loss(seconds.size() + happenings.size(), failure.what());
    return false;
  }
}

void HistoryWriter::note_loss(std::size_t rows, const std::string& why) {
  if (lost_now_ == 0) lost_since_ms_ = calendar_ms();
  lost_ += rows;
  lost_now_ += rows;
  trouble_ = why;
  database_->roll_back();
}

void HistoryWriter::trim() {
  Sqlite& sqlite = database_->sqlite;
  try {
    const auto delete_before = [&](std::int64_t at_s) {
      sqlite.run(
          fmt::format("BEGIN IMMEDIATE; DELETE FROM second WHERE at < {} AND encoder IN (SELECT id FROM encoder);"
                      "DELETE FROM happening WHERE at_ms < {}; COMMIT; PRAGMA incremental_vacuum",
                      at_s, at_s * 1000));
    };
    delete_before(calendar_ms() / 1000 - limits_.seconds);
    const std::int64_t page = sqlite.number("PRAGMA page_size");
    const std::int64_t used = page * (sqlite.number("PRAGMA page_count") - sqlite.number("PRAGMA freelist_count"));
    if (used <= limits_.bytes) return;
    // The oldest tenth: so this is rare.
    const std::int64_t oldest = std::min(sqlite.number("SELECT ifnull(min((SELECT min(at) FROM second WHERE "
                                                       "encoder = id)), 9e15) FROM encoder"),
                                         sqlite.number("SELECT ifnull(min(at_ms) / 1000, 9e15) FROM happening"));
    const std::int64_t now = calendar_ms() / 1000;
    if (oldest < now) delete_before(oldest + (now - oldest) / 10 + 1);
  } catch (const Failure& failure) {
    trouble_ = failure.what();
    database_->roll_back();
  }
}

struct HistoryReader::Database {
  explicit Database(const std::string& path) : sqlite("the history", path, Sqlite::For::reading) {}
  Sqlite sqlite;
};

HistoryReader::HistoryReader(const std::string& path) : database_(std::make_unique<Database>(path)) {}
HistoryReader::~HistoryReader() = default;

Json HistoryReader::seconds(const std::string& encoder, Range range, std::int64_t most) {
  const std::int64_t step =
      std::max<std::int64_t>(1, (range.to_s - range.from_s) / std::max<std::int64_t>(1, most) + 1);
  Statement rows(database_->sqlite,
                 "SELECT at / ?1 * ?1, min(least), avg(mean), max(greatest), min(speed_least), avg(speed_mean), "
                 "max(speed_greatest), sum(readings), sum(errors) FROM second "
                 "WHERE encoder = (SELECT id FROM encoder WHERE name = ?2) AND at BETWEEN ?3 AND ?4 GROUP BY at / ?1 "
                 "ORDER BY at LIMIT ?5");
  rows.bind(1, step).bind(2, encoder).bind(3, range.from_s).bind(4, range.to_s).bind(5, most);
  Json list = Json::array();
  while (rows.next()) {
    Json row = Json::array();
    row.append(rows.integer(0));
    for (int column = 1; column <= 6; ++column) row.append(real_or_null(rows, column));
    list.append(row.append(rows.integer(7)).append(rows.integer(8)));
  }
  return Json::object().set("encoder", encoder).set("step_s", step).set("rows", list);
}

Json HistoryReader::happenings(const std::string& encoder, Range range, std::int64_t most) {
  Statement rows(database_->sqlite,
                 "SELECT at_ms, encoder, kind, text, who FROM happening WHERE at_ms BETWEEN ?1 AND ?2 AND (?3 = '' OR "
                 "encoder = ?3) ORDER BY at_ms DESC, id DESC LIMIT ?4");
  rows.bind(1, range.from_s * 1000).bind(2, range.to_s * 1000 + 999).bind(3, encoder).bind(4, most);
  Json list = Json::array();
  while (rows.next()) {
    list.append(Happening{rows.integer(0), rows.text(1), rows.text(2), rows.text(3), rows.text(4)}.json());
  }
  return Json::object().set("events", list);
}

std::string_view HistoryReader::csv_header() {
  return "encoder,at_s,readings,errors,least,mean,greatest,speed_least,speed_mean,speed_greatest\n";
}

std::pair<std::string, std::int64_t> HistoryReader::csv(const std::string& encoder, Range range, std::int64_t most) {
  Statement rows(database_->sqlite,
                 "SELECT at, readings, errors, least, mean, greatest, speed_least, speed_mean, speed_greatest FROM "
                 "second WHERE encoder = (SELECT id FROM encoder WHERE name = ?1) AND at BETWEEN ?2 AND ?3 ORDER BY at "
                 "LIMIT ?4");
  rows.bind(1, encoder).bind(2, range.from_s).bind(3, range.to_s).bind(4, most);
  std::string text;
  std::int64_t count = 0;
  std::int64_t next = range.from_s;
  for (const std::string name = csv_text(encoder); rows.next(); ++count) {
    next = rows.integer(0) + 1;
    text += fmt::format("{},{},{},{}", name, rows.integer(0), rows.integer(1), rows.integer(2));
    for (int column = 3; column <= 8; ++column) text += ',' + csv_real(rows, column);
    text += '\n';
  }
  return {std::move(text), count < most ? range.to_s + 1 : next};
}

}  // namespace absenc::serve
