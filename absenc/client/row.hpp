// SPDX-License-Identifier: Apache-2.0
// Rows of named and typed values, such as the result of a command or one exchange of a capture.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absenc/client/reading.hpp"

namespace absenc::client {

/// Type of the values in a column.
enum class ColumnType : std::uint8_t { int64, uint64, real, boolean, flags, text, bytes };

/// Name, unit of measure, type and meaning of a value that each row has.
struct Column {
  /// Number format in text and CSV, and which tables or lists leave the value out.
  struct Presentation {
    /// Format of a real number, as for std::format; "": the shortest text from which the same number can be read back.
    std::string_view format{};
    bool is_detail = false;  ///< Whether tables with one line for each row leave the value out.
    /// Whether the number is shown in hexadecimal; tables of values show it in decimal nevertheless.
    bool in_hex = false;
    /// Whether the value only repeats the request, or shows bytes of the reply.
    bool is_exchange = false;
  };

  std::string_view name;        ///< Name of the column, in `snake_case`.
  std::string_view unit;        ///< Unit of the value, as "deg"; "" if it has none.
  ColumnType type;              ///< Type of the values.
  std::string_view meaning;     ///< Meaning of the value, as a phrase.
  Presentation presentation{};  ///< Number format, and where the value is left out.
};

/// Type of a value that is a sequence of bytes.
using ByteVector = std::vector<std::uint8_t>;

/// Alternative of `Value` for a value that is invalid; the value itself is not stored.
struct Invalid {
  /// Returns true, because all invalid values are equal.
  friend bool operator==(const Invalid&, const Invalid&) = default;
};

/// Alternative of `Value` for a value that is not known.
struct Unknown {
  /// Returns true, because all unknown values are equal.
  friend bool operator==(const Unknown&, const Unknown&) = default;
};

/// Type of a value in a row: std::monostate without a value; the types of `ColumnType` in their order; `Invalid`;
/// `Unknown`.
using Value = std::variant<std::monostate, std::int64_t, std::uint64_t, double, bool, Flags, std::string, ByteVector,
                           Invalid, Unknown>;

/// Returns whether the value is not missing, invalid or unknown.
[[nodiscard]] inline bool has_value(const Value& value) {
  return value.index() != 0 && !std::holds_alternative<Invalid>(value) && !std::holds_alternative<Unknown>(value);
}

/// Returns the raised flags as a value; `Unknown` if none is raised and a flag that is not optional was not reported.
[[nodiscard]] Value value_of(const Flags& flags);
/// Returns whether the validity is `valid`; no value if it is absent, `Unknown` if it is unknown.
[[nodiscard]] Value value_of(Validity validity);

/// Returns the value as text, as "12.5", "yes" or "1A 00"; "" if there is no value, or if no flag is raised.
[[nodiscard]] std::string to_text(const Value& value);
/// Returns the value of a column as text with its unit: "80 degC".
[[nodiscard]] std::string to_text(const Column& column, const Value& value);

/// A row: values with their columns, which the owner of the row owns.
struct Row {
  std::span<const Column> columns;  ///< Descriptions of the values; the owner of the row owns them.
  std::vector<Value> values;        ///< Values of the row, one for each column.

  /// Returns the value of the column `name`. Throws UsageError.
  [[nodiscard]] const Value& operator[](std::string_view name) const;
  /// Returns the value of the column `name` as type `T`. Throws UsageError, std::bad_variant_access.
  template <class T>
  [[nodiscard]] const T& get(std::string_view name) const {
    return std::get<T>((*this)[name]);
  }
};

/// Returns a field's description as the column of a row.
[[nodiscard]] Column column_of(const FieldInfo& field);
/// Returns the value of a decoded field as a value for a row.
[[nodiscard]] Value value_of(const FieldValue& value);

/// Result of a command: a row that owns its columns.
struct Answer {
  std::vector<Column> columns;  ///< Descriptions of the values, one for each value.
  std::vector<Value> values;    ///< Values in the order of the columns.
  /// Owners of the column names, some of which would otherwise live only as long as the encoder.
  std::vector<std::shared_ptr<const std::string>> names;

  /// Returns columns and values as a row, which is valid while this object is unchanged.
  [[nodiscard]] Row row() const { return {columns, values}; }
  /// Returns the value of the column `name`; throws UsageError if there is no such column.
  [[nodiscard]] const Value& operator[](std::string_view name) const;
};

/// A sink that collects the fields of a reply into an answer.
class AnswerSink final : public FieldSink {
 public:
  /// Adds the field as a column with its value, or replaces the value if the column exists.
  void put(const FieldValue& value) override;
  void put_reading(const Reading& reading) override;

  Answer answer;  ///< Columns and values that were collected so far.

 private:
  std::vector<FieldInfo> fields_;
};

}  // namespace absenc::client
