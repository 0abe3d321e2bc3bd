// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/sqlite.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

namespace absenc::serve {

namespace {

constexpr int lock_timeout_ms = 2000;  // time to wait for a lock that another program holds

}  // namespace

Sqlite::Sqlite(const std::string& title, const std::string& path, For what) : title_(title + " " + path) {
  const int flags = what == For::writing ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY;
  if (::sqlite3_open_v2(path.c_str(), &handle_, flags | SQLITE_OPEN_NOMUTEX, nullptr) == SQLITE_OK) {
    ::sqlite3_busy_timeout(handle_, lock_timeout_ms);
    return;
  }
  const std::string why = handle_ == nullptr ? "no memory" : ::sqlite3_errmsg(handle_);
  ::sqlite3_close(handle_);
  throw client::Failure(fmt::format("{}: {}", title_, why));
}

Sqlite::~Sqlite() { ::sqlite3_close(handle_); }

void Sqlite::fail() const {
  const std::string words = fmt::format("{}: {}", title_, ::sqlite3_errmsg(handle_));
  const int error = ::sqlite3_errcode(handle_) & 0xff;
  if (error == SQLITE_CORRUPT || error == SQLITE_NOTADB) throw DamagedFile(words);
  throw client::Failure(words);
}

void Sqlite::run(const std::string& sql) {
  if (::sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail();
}

std::int64_t Sqlite::number(const std::string& sql) {
  Statement statement(*this, sql);
  return statement.next() ? statement.integer(0) : 0;
}

void Sqlite::keep_log_on_close() { ::sqlite3_db_config(handle_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr); }

bool Sqlite::in_transaction() const { return ::sqlite3_get_autocommit(handle_) == 0; }

Statement::Statement(Sqlite& database, std::string_view sql) : database_(&database) {
  const int error = ::sqlite3_prepare_v2(database.handle_, sql.data(), static_cast<int>(sql.size()), &handle_, nullptr);
  if (error != SQLITE_OK) database.fail();
}

Statement::~Statement() { ::sqlite3_finalize(handle_); }

Statement& Statement::bind(int parameter, std::int64_t value) {
  if (::sqlite3_bind_int64(handle_, parameter, value) != SQLITE_OK) database_->fail();
  return *this;
}

Statement& Statement::bind(int parameter, double value) {
  if (::sqlite3_bind_double(handle_, parameter, value) != SQLITE_OK) database_->fail();
  return *this;
}

Statement& Statement::bind(int parameter, const std::string& value) {
  const auto size = static_cast<int>(value.size());
  // The value -1 is SQLITE_TRANSIENT, written without its C cast: SQLite copies the text.
  if (::sqlite3_bind_text(handle_, parameter, value.data(), size, reinterpret_cast<sqlite3_destructor_type>(-1)) !=
      SQLITE_OK) {
    database_->fail();
  }
  return *this;
}

Statement& Statement::bind_null(int parameter) {
  if (::sqlite3_bind_null(handle_, parameter) != SQLITE_OK) database_->fail();
  return *this;
}

bool Statement::next() {
  const int result = ::sqlite3_step(handle_);
  if (result == SQLITE_ROW) return true;
  if (result != SQLITE_DONE) {
    reset();
    database_->fail();
  }
  reset();
  return false;
}

void Statement::run() {
  while (next()) {
  }
}

void Statement::reset() { ::sqlite3_reset(handle_); }

bool Statement::is_null(int column) const { return ::sqlite3_column_type(handle_, column) == SQLITE_NULL; }
std::int64_t Statement::integer(int column) const { return ::sqlite3_column_int64(handle_, column); }
double Statement::real(int column) const { return ::sqlite3_column_double(handle_, column); }
std::string Statement::text(int column) const {
  const unsigned char* text = ::sqlite3_column_text(handle_, column);
  return text == nullptr ? std::string() : reinterpret_cast<const char*>(text);
}

}  // namespace absenc::serve
