// SPDX-License-Identifier: Apache-2.0
// As much of SQLite as the history needs, with errors thrown. The library behind it is seen by sqlite.cpp alone.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absenc/client/error.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace absenc::serve {

/// The file is no database, or damaged.
struct DamagedFile : client::Failure {
  using client::Failure::Failure;
};

/// An open database. Everything throws client::Failure, in the words of SQLite.
class Sqlite {
 public:
  enum class For : std::uint8_t { writing, reading };
  /// `title` begins what it says of errors.
  Sqlite(const std::string& title, const std::string& path, For what);
  ~Sqlite();
  Sqlite(const Sqlite&) = delete;
  Sqlite& operator=(const Sqlite&) = delete;

  void run(const std::string& sql);
  /// The one number that this asks for.
  [[nodiscard]] std::int64_t number(const std::string& sql);
  /// Whether a transaction is open: a full disk may have ended it.
  [[nodiscard]] bool in_transaction() const;
  /// When it is closed, the write-ahead log stays as it is: neither written to the database nor deleted.
  void leave_log();

 private:
  friend class Statement;
  [[noreturn]] void fail() const;

  std::string title_;
  sqlite3* handle_ = nullptr;
};

/// One that is prepared once and run often. Parameters count from 1, columns from 0.
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

  /// True while there is a row; false at the end, and it can be run again.
  bool next();
  /// To the end.
  void run();
  /// Begins again, whatever happened.
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
