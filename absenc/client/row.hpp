// SPDX-License-Identifier: Apache-2.0
// Named and typed values: what a command told, or one exchange of a capture.
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

enum class Type : std::uint8_t { int64, uint64, real, boolean, flags, text, bytes };

/// Description of a value in each row.
struct Column {
  /// How it is shown where all is text.
  struct Look {
    std::string_view format{};  ///< of a real, as for std::format: "{:.6f}"; "": as short as it is exact
    bool is_detail = false;     ///< left out where a row is a line of a table
    bool in_hex = false;        ///< a number that people read in hexadecimal; tables of values have it in decimal
    /// It repeats the request, or shows the bytes of the answer: the encoder says nothing of itself by it.
    bool is_exchange = false;
  };

  std::string_view name;     ///< Name of the column, in `snake_case`.
  std::string_view unit;     ///< "" for a plain number
  Type type;                 ///< Type of the values.
  std::string_view meaning;  ///< Meaning of the value, as a phrase.
  Look look{};               ///< How a table for people shows it.
};

using ByteVector = std::vector<std::uint8_t>;

/// In place of a value that was told but does not hold: it is never shown.
struct Invalid {
  /// Compares equal: there is one kind of invalid value.
  friend bool operator==(const Invalid&, const Invalid&) = default;
};

/// In place of a value that no reply has reported so far: alarms that a reply does not carry, whether a position holds.
struct Unknown {
  /// Compares equal: there is one kind of unknown value.
  friend bool operator==(const Unknown&, const Unknown&) = default;
};

/// In the order of `Type`, between nothing, which the row does not have, and `Invalid` and `Unknown`.
using Value = std::variant<std::monostate, std::int64_t, std::uint64_t, double, bool, Flags, std::string, ByteVector,
                           Invalid, Unknown>;

/// Whether it is one of the types of `Type`.
[[nodiscard]] inline bool has_value(const Value& value) {
  return value.index() != 0 && !std::holds_alternative<Invalid>(value) && !std::holds_alternative<Unknown>(value);
}

/// Flags that are raised, or all clear; otherwise `Unknown`.
[[nodiscard]] Value value_of(const Flags& flags);
/// Yes or no, or `Unknown`; nothing of what is absent.
[[nodiscard]] Value value_of(Validity validity);

/// "12.5", "yes", "over_heat battery_alarm", "1A 00"; "" where there is no value, and of flags of which none is raised.
[[nodiscard]] std::string to_text(const Value& value);
/// The same with its unit: "80 degC".
[[nodiscard]] std::string to_text(const Column& column, const Value& value);

/// Values with their columns. Both are valid while their owner is unchanged.
struct Row {
  std::span<const Column> columns;  ///< of the maker of the row
  std::vector<Value> values;        ///< one for each

  /// Throws UsageError when there is no such column; it names the nearest.
  [[nodiscard]] const Value& operator[](std::string_view name) const;
  /// The same as a type of `Value`; throws std::bad_variant_access when it is another, or nothing.
  template <class T>
  [[nodiscard]] const T& get(std::string_view name) const {
    return std::get<T>((*this)[name]);
  }
};

[[nodiscard]] Column column_of(const FieldInfo& field);
[[nodiscard]] Value value_of(const FieldValue& value);

/// What a command told: a row that knows its columns.
struct Answer {
  std::vector<Column> columns;  ///< Descriptions of the values.
  std::vector<Value> values;    ///< Values in the order of the columns.
  /// The names of the columns: those of a word that the user described are no longer there than the encoder is.
  std::vector<std::shared_ptr<const std::string>> names;

  /// Returns columns and values as a row, which is valid while this answer is.
  [[nodiscard]] Row row() const { return {columns, values}; }
  /// Returns the value of the column `name`; throws UsageError if there is no such column.
  [[nodiscard]] const Value& operator[](std::string_view name) const;
};

/// Makes an answer of fields; those of a position that does not hold are `Invalid`, or `Unknown` where nobody has
/// reported whether it does. A field that comes again, as in a list, has its last value.
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
