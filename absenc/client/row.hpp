// SPDX-License-Identifier: Apache-2.0
// Named and typed values: the result of a command, or one exchange of a capture.
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

/// Type of a value.
enum class ColumnType : std::uint8_t { int64, uint64, real, boolean, flags, text, bytes };

/// Description of a value in each row.
struct Column {
  /// How the value is printed as text.
  struct Presentation {
    std::string_view format{};  ///< Format of a real number, as for std::format, "{:.6f}"; "": the shortest exact text.
    bool is_detail = false;     ///< Left out where each row is a line of a table.
    bool in_hex = false;        ///< People read the number in hexadecimal; tables of values print it in decimal.
    /// The value repeats the request or shows the bytes of the reply. It is no property of the encoder.
    bool is_exchange = false;
  };

  std::string_view name;        ///< Name of the column, in `snake_case`.
  std::string_view unit;        ///< Unit of the value; "" for a plain number.
  ColumnType type;              ///< Type of the values.
  std::string_view meaning;     ///< Meaning of the value, as a phrase.
  Presentation presentation{};  ///< How a table for people shows it.
};

/// Bytes as a value.
using ByteVector = std::vector<std::uint8_t>;

/// Replaces a value that the encoder reported as invalid. The value itself is never shown.
struct Invalid {
  /// Compares equal: there is one kind of invalid value.
  friend bool operator==(const Invalid&, const Invalid&) = default;
};

/// Replaces a value that no reply has reported so far, such as alarms that a reply does not carry or the validity of a
/// position.
struct Unknown {
  /// Compares equal: there is one kind of unknown value.
  friend bool operator==(const Unknown&, const Unknown&) = default;
};

/// A value. The alternatives are: nothing, if the row has no value; those of `ColumnType` in its order; `Invalid`;
/// `Unknown`.
using Value = std::variant<std::monostate, std::int64_t, std::uint64_t, double, bool, Flags, std::string, ByteVector,
                           Invalid, Unknown>;

/// Returns whether the value has one of the types of `ColumnType`.
[[nodiscard]] inline bool has_value(const Value& value) {
  return value.index() != 0 && !std::holds_alternative<Invalid>(value) && !std::holds_alternative<Unknown>(value);
}

/// Returns the flags if their state is known, otherwise `Unknown`.
[[nodiscard]] Value value_of(const Flags& flags);
/// Returns true or false, or `Unknown`; no value if the field is absent.
[[nodiscard]] Value value_of(Validity validity);

/// Returns "12.5", "yes", "over_heat battery_alarm" or "1A 00"; "" if there is no value or no flag is raised.
[[nodiscard]] std::string to_text(const Value& value);
/// Returns the value with its unit: "80 degC".
[[nodiscard]] std::string to_text(const Column& column, const Value& value);

/// Values with their columns. Columns and values stay valid while their owner is unchanged.
struct Row {
  std::span<const Column> columns;  ///< Descriptions of the values; the maker of the row owns them.
  std::vector<Value> values;        ///< Values, one for each column.

  /// Returns the value of the column `name`. Throws UsageError, which suggests the nearest name, if there is no such
  /// column.
  [[nodiscard]] const Value& operator[](std::string_view name) const;
  /// Returns the value of the column `name` as type `T`. Throws std::bad_variant_access if the value has another type
  /// or is missing.
  template <class T>
  [[nodiscard]] const T& get(std::string_view name) const {
    return std::get<T>((*this)[name]);
  }
};

/// Returns the column of a field.
[[nodiscard]] Column column_of(const FieldInfo& field);
/// Returns the value of a field as a value of a row.
[[nodiscard]] Value value_of(const FieldValue& value);

/// Result of a command: a row that owns its columns.
struct Answer {
  std::vector<Column> columns;  ///< Descriptions of the values.
  std::vector<Value> values;    ///< Values in the order of the columns.
  /// Owners of column names. Names from a described position word otherwise live only as long as the encoder.
  std::vector<std::shared_ptr<const std::string>> names;

  /// Returns columns and values as a row, which is valid while this answer is.
  [[nodiscard]] Row row() const { return {columns, values}; }
  /// Returns the value of the column `name`; throws UsageError if there is no such column.
  [[nodiscard]] const Value& operator[](std::string_view name) const;
};

/// Collects the fields of a reply into an answer. Fields of an invalid position become `Invalid`; those of a position
/// whose validity nobody has reported become `Unknown`. If a field repeats, as in a list, the last value is stored.
class AnswerSink final : public FieldSink {
 public:
  /// Adds a column with its value.
  void put(const FieldValue& value) override;
  void put_reading(const Reading& reading) override;

  Answer answer;  ///< The columns and values so far.

 private:
  std::vector<FieldInfo> fields_;
};

}  // namespace absenc::client
