// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/row.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "absenc/client/error.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"

namespace absenc::client {

namespace {

std::size_t index_of(std::span<const Column> columns, std::string_view name) {
  std::vector<std::string_view> names;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].name == name) return i;
    names.push_back(columns[i].name);
  }
  throw UsageError(fmt::format("there is no column \"{}\"{}", name, suggestion(name, names)));
}

struct ValueText {
  std::string operator()(std::monostate) const { return {}; }
  std::string operator()(Invalid) const { return {}; }
  std::string operator()(Unknown) const { return {}; }
  std::string operator()(bool value) const { return value ? "yes" : "no"; }
  std::string operator()(const Flags& flags) const {
    return fmt::format("{}", fmt::join(flag_names(*flags.field, flags.bits), " "));
  }
  std::string operator()(const std::string& text) const { return text; }
  std::string operator()(const ByteVector& bytes) const { return to_hex(bytes); }
  template <class Number>
  std::string operator()(Number value) const {
    return fmt::format("{}", value);
  }
};

}  // namespace

Value value_of(const Flags& flags) {
  const bool is_known = flags.is_complete() || !raised(*flags.field, flags.bits).empty();
  return is_known ? Value(flags) : Value(Unknown{});
}

Value value_of(Validity validity) {
  switch (validity) {
    case Validity::absent:
      return {};
    case Validity::unknown:
      return Unknown{};
    default:
      return validity == Validity::valid;
  }
}

std::string to_text(const Value& value) { return std::visit(ValueText{}, value); }

std::string to_text(const Column& column, const Value& value) {
  const auto* const number = std::get_if<std::int64_t>(&value);
  const std::string text = number != nullptr && column.presentation.in_hex ? hexadecimal(*number) : to_text(value);
  return column.unit.empty() || text.empty() ? text : fmt::format("{} {}", text, column.unit);
}

const Value& Row::operator[](std::string_view name) const { return values[index_of(columns, name)]; }
const Value& Answer::operator[](std::string_view name) const { return values[index_of(columns, name)]; }

Column column_of(const FieldInfo& field) {
  static constexpr std::array types{ColumnType::int64, ColumnType::uint64, ColumnType::boolean, ColumnType::flags,
                                    ColumnType::real,  ColumnType::text,   ColumnType::bytes};
  const bool is_exchange = field.role == Role::exchange || field.role == Role::data;
  const Column::Presentation presentation{.in_hex = field.in_hex, .is_exchange = is_exchange};
  return {field.name, field.unit, types[static_cast<std::size_t>(field.kind)], field.meaning, presentation};
}

Value value_of(const FieldValue& value) {
  switch (value.info->kind) {
    case FieldInfo::Kind::counts:
      return static_cast<std::uint64_t>(value.number);
    case FieldInfo::Kind::boolean:
      return value.number != 0;
    case FieldInfo::Kind::flags:
      return Flags{value.info, static_cast<std::uint32_t>(value.number)};
    case FieldInfo::Kind::real:
      return value.real;
    case FieldInfo::Kind::text:
      return printable(value.bytes);
    case FieldInfo::Kind::bytes:
      return ByteVector(value.bytes.begin(), value.bytes.end());
    case FieldInfo::Kind::number:
      break;
  }
  return value.number;
}

void AnswerSink::put(const FieldValue& value) {
  const auto same = std::find_if(fields_.begin(), fields_.end(),
                                 [&](const FieldInfo& field) { return field.name == value.info->name; });
  if (same != fields_.end()) {
    answer.values[static_cast<std::size_t>(same - fields_.begin())] = value_of(value);
    return;
  }
  answer.names.push_back(std::make_shared<const std::string>(value.info->name));
  fields_.push_back(*value.info);
  fields_.back().name = *answer.names.back();
  answer.columns.push_back(column_of(fields_.back()));
  answer.values.push_back(value_of(value));
}

void AnswerSink::put_reading(const Reading& reading) {
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const Validity validity = validity_of(fields_[i], reading);
    if (validity == Validity::invalid) answer.values[i] = Invalid{};
    if (validity == Validity::unknown) answer.values[i] = Unknown{};
  }
}

}  // namespace absenc::client
