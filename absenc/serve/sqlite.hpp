// SPDX-License-Identifier: Apache-2.0
// The parts of SQLite that the history uses. Only sqlite.cpp includes the library's header.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absenc/client/error.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace absenc::serve {

/// Thrown when a file is no SQLite database or is damaged.
struct DamagedFile : client::Failure {
  using client::Failure::Failure;
};

/// An open SQLite database. Functions that fail throw client::Failure or DamagedFile.
class Sqlite {
 public:
  enum class For : std::uint8_t { writing, reading };
  /// Opens the database at `path`. `title` begins each error text.
  Sqlite(const std::string& title, const std::string& path, For what);
  ~Sqlite();
  Sqlite(const Sqlite&) = delete;
  Sqlite& operator=(const Sqlite&) = delete;

  void run(const std::string& sql);
  /// Returns the number that is the single result of a query; 0 if the query yields no row.
  [[nodiscard]] std::int64_t number(const std::string& sql);
  /// Returns whether a transaction is open. SQLite itself may end a transaction after an error.
  [[nodiscard]] bool in_transaction() const;
  /// Causes the later closing of the database to leave its write-ahead log unchanged.
  void keep_log_on_close();

 private:
  friend class Statement;
  [[noreturn]] void fail() const;

  std::string title_;
  sqlite3* handle_ = nullptr;
};

/// A prepared statement. Parameters are numbered from 1, columns from 0.
class Statement {
 public:
  Statement(Sqlite& database, std::string_view sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(int parameter, std::int64_t value);
  Statement& bind(int parameter, double value);
  Statement& bind(int parameter, const std::string& value);
  Statement& bind_null(int parameter);

  /// Moves to the next row. Returns false behind the last row.
  bool next();
  /// Runs the statement to its end, ignoring its rows.
  void run();
  /// Resets the statement so that it can run again, even after an error.
  void reset();

  [[nodiscard]] bool is_null(int column) const;
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::string text(int column) const;

 private:
  Sqlite* database_;
  sqlite3_stmt* handle_ = nullptr;
};

}  // namespace absenc::serve
