// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/os/error.hpp"

namespace absenc::serve {

using namespace client;

namespace {

// Adds a row for one second of an encoder. The row is merged with an existing row of the same calendar second: a second
// occurs twice if the clock was set back or the server was restarted.
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

HistoryWriter::HistoryWriter(std::string path, const HistoryLimits& limits)
    : path_(std::move(path)), reader_(path_), limits_(limits) {
  try {
    open();
  } catch (const HistoryInUse&) {
    throw;
  } catch (const std::runtime_error& failure) {  // `open` throws client::Failure or os::Failure
    trouble_ = failure.what();
    reader_.refuse(trouble_);
  }
  trim();
}
HistoryWriter::~HistoryWriter() = default;

// A file that is damaged when the server starts is not renamed, because it may belong to another program.
void HistoryWriter::open() {
  try {
    file_.emplace(path_);
  } catch (const DamagedFile& damaged) {
    if (!was_open_) {
      throw Failure(fmt::format("{}: move it away, and within a second a new history begins there", damaged.what()));
    }
    notes_.push_back(fmt::format("{}: it was renamed to {}, and a new history begins", damaged.what(),
                                 HistoryFile::set_aside(path_)));
    file_.emplace(path_);
  }
  was_open_ = true;
  reader_.accept();
}

// Ensures that an intact history file is open, and that it is the file at the path of the history.
void HistoryWriter::require_file() {
  if (file_) {
    const HistoryFile::State state = file_->check();
    if (state == HistoryFile::State::whole) return;
    if (state == HistoryFile::State::damaged) {
      set_aside("was cut off or overwritten");
    } else {
      close_file(state);
    }
  }
  open();
}

void HistoryWriter::close_file(HistoryFile::State state) {
  const std::string_view what = state == HistoryFile::State::changed ? "was changed by another program: it is continued"
                                : state == HistoryFile::State::gone
                                    ? "was moved or removed: a new one begins"
                                    : "was replaced by another file: it is continued there";
  notes_.push_back(fmt::format("the history {} {}", path_, what));
  reader_.refuse(notes_.back());
  state == HistoryFile::State::changed ? file_->close() : file_->close_moved();
  file_.reset();
}

void HistoryWriter::set_aside(std::string_view why) {
  reader_.refuse(fmt::format("the history {} {}", path_, why));
  notes_.push_back(
      fmt::format("the history {} {}: it was renamed to {}, and a new one begins", path_, why, file_->set_aside()));
  file_.reset();
}

void HistoryWriter::write(const std::vector<Entry>& seconds, const std::vector<ServerEvent>& server_events) {
  try {
    require_file();
    try {
      insert(seconds, server_events);
    } catch (const DamagedFile& damaged) {
      set_aside(fmt::format("is damaged ({})", damaged.what()));
      open();
      insert(seconds, server_events);
    }
    if (unreported_losses_ != 0) {
      notes_.push_back(fmt::format("{} rows since {} could not be written: {}", unreported_losses_,
                                   lost_since_ms_ / 1000, trouble_));
    }
    unreported_losses_ = 0;
    trouble_.clear();
  } catch (const Failure& failure) {
    note_loss(seconds.size() + server_events.size(), failure.what());
  } catch (const os::Failure& failure) {
    note_loss(seconds.size() + server_events.size(), failure.what());
  }
}

void HistoryWriter::insert(const std::vector<Entry>& seconds, const std::vector<ServerEvent>& server_events) {
  Sqlite& sqlite = file_->sqlite();
  sqlite.run("BEGIN IMMEDIATE");
  {
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
    Statement server_event(sqlite, "INSERT INTO happening (at_ms, encoder, kind, text, who) VALUES (?, ?, ?, ?, ?)");
    for (const ServerEvent& one : server_events) {
      server_event.bind(1, one.at_ms).bind(2, one.encoder).bind(3, one.kind).bind(4, one.text).bind(5, one.who).run();
    }
  }
  sqlite.run("COMMIT");
  file_->note_written();
}

void HistoryWriter::note_loss(std::size_t rows, const std::string& why) {
  if (unreported_losses_ == 0) lost_since_ms_ = calendar_ms();
  if (trouble_.empty()) notes_.push_back(fmt::format("the history cannot be written: {}", why));
  lost_ += rows;
  unreported_losses_ += rows;
  trouble_ = why;
  if (!file_) reader_.refuse(why);
  roll_back();
}

void HistoryWriter::roll_back() {
  try {
    if (file_ && file_->sqlite().in_transaction()) file_->sqlite().run("ROLLBACK");
  } catch (const Failure&) {  // SQLite has already rolled the transaction back
  }
}

std::vector<std::string> HistoryWriter::take_notes() { return std::exchange(notes_, {}); }

void HistoryWriter::trim() {
  if (!file_) return;
  try {
    const std::int64_t too_old = calendar_ms() / 1000 - limits_.seconds;
    if (has_day_of_rows_since(too_old)) delete_before(too_old);
    Sqlite& sqlite = file_->sqlite();
    const std::int64_t page = sqlite.number("PRAGMA page_size");
    const std::int64_t used = page * (sqlite.number("PRAGMA page_count") - sqlite.number("PRAGMA freelist_count"));
    if (used > limits_.bytes) delete_before(end_of_oldest_tenth());
  } catch (const std::exception& failure) {
    trouble_ = failure.what();
    roll_back();
  }
}

// Returns whether an encoder has rows in at least 24 different hours since the calendar second `at_s`.
bool HistoryWriter::has_day_of_rows_since(std::int64_t at_s) {
  constexpr std::int64_t hours = 24;
  Statement encoders(file_->sqlite(), "SELECT id FROM encoder");
  Statement found(file_->sqlite(),
                  "WITH RECURSIVE hour(at) AS (SELECT (SELECT min(at) FROM second WHERE encoder = ?1 AND at >= ?2) "
                  "UNION ALL SELECT (SELECT min(at) FROM second WHERE encoder = ?1 AND at >= (hour.at / 3600 + 1) * "
                  "3600) FROM hour WHERE hour.at IS NOT NULL LIMIT ?3) SELECT count(at) FROM hour");
  while (encoders.next()) {
    found.reset();
    found.bind(1, encoders.integer(0)).bind(2, at_s).bind(3, hours);
    if (found.next() && found.integer(0) == hours) return true;
  }
  return false;
}

// Returns the calendar second before which the oldest tenth of the rows lies, counting only the encoder that has most
// rows. If no encoder has rows, returns the calendar second before which the oldest tenth of the events lies.
std::int64_t HistoryWriter::end_of_oldest_tenth() {
  Sqlite& sqlite = file_->sqlite();
  const std::int64_t most = sqlite.number(
      "SELECT ifnull((SELECT id FROM encoder ORDER BY (SELECT count(*) FROM second WHERE encoder = id) DESC LIMIT 1), "
      "0)");
  const auto tenth = [&](std::string_view column, const std::string& rows) {
    return sqlite.number(
        fmt::format("SELECT ifnull((SELECT {0} FROM {1} ORDER BY {0} LIMIT 1 OFFSET (SELECT count(*) / "
                    "10 FROM {1})), 0)",
                    column, rows));
  };
  const std::int64_t second = tenth("at", fmt::format("second WHERE encoder = {}", most));
  return second != 0 ? second + 1 : tenth("at_ms", "happening") / 1000 + 1;
}

void HistoryWriter::delete_before(std::int64_t at_s) {
  file_->sqlite().run(
      fmt::format("BEGIN IMMEDIATE; DELETE FROM second WHERE at < {} AND encoder IN (SELECT id FROM encoder);"
                  "DELETE FROM happening WHERE at_ms < {}; COMMIT; PRAGMA incremental_vacuum",
                  at_s, at_s * 1000));
  file_->note_written();
}

HistoryReader::HistoryReader(std::string path) : path_(std::move(path)) {}
HistoryReader::~HistoryReader() = default;

void HistoryReader::refuse(const std::string& why) {
  const std::lock_guard lock(mutex_);
  database_.reset();
  refused_ = why;
}

void HistoryReader::accept() {
  const std::lock_guard lock(mutex_);
  refused_.clear();
}

// Returns the open history database, or opens it. The caller must hold the mutex.
Sqlite& HistoryReader::database() {
  if (!refused_.empty()) throw Failure(refused_);
  if (!database_) database_.emplace("the history", path_, Sqlite::For::reading);
  return *database_;
}

Json HistoryReader::seconds(const std::string& encoder, Range range, std::int64_t most) {
  // Each row of a response stands for `step` seconds and begins at a multiple of `step`, so a range may need one row
  // more than its length divided by `step`.
  most = std::max<std::int64_t>(1, most);
  std::int64_t step = std::max<std::int64_t>(1, (range.to_s - range.from_s) / most + 1);
  while (range.to_s / step - range.from_s / step >= most) ++step;
  const std::lock_guard lock(mutex_);
  Statement rows(database(),
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

Json HistoryReader::server_events(const std::string& encoder, Range range, std::int64_t most) {
  const std::lock_guard lock(mutex_);
  Statement rows(database(),
                 "SELECT at_ms, encoder, kind, text, who FROM happening WHERE at_ms BETWEEN ?1 AND ?2 AND (?3 = '' OR "
                 "encoder = ?3) ORDER BY at_ms DESC, id DESC LIMIT ?4");
  rows.bind(1, range.from_s * 1000).bind(2, range.to_s * 1000 + 999).bind(3, encoder).bind(4, most);
  Json list = Json::array();
  while (rows.next()) {
    list.append(ServerEvent{rows.integer(0), rows.text(1), rows.text(2), rows.text(3), rows.text(4)}.json());
  }
  return Json::object().set("events", list);
}

std::string_view HistoryReader::csv_header() {
  return "encoder,at_s,readings,errors,least,mean,greatest,speed_least,speed_mean,speed_greatest\n";
}

std::pair<std::string, std::int64_t> HistoryReader::csv(const std::string& encoder, Range range, std::int64_t most) {
  const std::lock_guard lock(mutex_);
  Statement rows(database(),
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
