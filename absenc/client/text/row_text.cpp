// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/row_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <iterator>

#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

namespace {

void append_quoted(std::string& line, std::string_view text) {
  if (text.find_first_of(",\"\n\r") == std::string_view::npos) {
    line += text;
    return;
  }
  line += '"';
  for (const char c : text) line.append(c == '"' ? 2 : 1, c);
  line += '"';
}

struct Cell {
  std::string& line;
  std::string_view format;

  void operator()(std::monostate) const {}
  void operator()(Invalid) const {}
  void operator()(Unknown) const {}
  void operator()(bool value) const { line += value ? "true" : "false"; }
  void operator()(std::int64_t value) const { fmt::format_to(std::back_inserter(line), "{}", value); }
  void operator()(std::uint64_t value) const { fmt::format_to(std::back_inserter(line), "{}", value); }
  void operator()(double value) const {
    fmt::format_to(std::back_inserter(line), fmt::runtime(format.empty() ? "{}" : format), value);
  }
  void operator()(const std::string& text) const { append_quoted(line, text); }
  // Prints "none" if no flag is raised: an empty cell means that flags were not reported.
  void operator()(const Flags& flags) const {
    const std::string names = to_text(Value(flags));
    append_quoted(line, names.empty() ? "none" : names);
  }
  template <class Other>
  void operator()(const Other& other) const {
    append_quoted(line, to_text(Value(other)));
  }
};

}  // namespace

std::string csv_header(std::span<const Column> columns) {
  std::string names;
  for (const Column& column : columns) {
    if (!column.presentation.is_detail) names += fmt::format("{}{}", names.empty() ? "" : ",", column.name);
  }
  return names;
}

void append_csv(std::string& text, const Row& row) {
  bool is_first = true;
  for (std::size_t i = 0; i < row.columns.size(); ++i) {
    const Column& column = row.columns[i];
    if (column.presentation.is_detail) continue;
    if (!is_first) text += ',';
    is_first = false;
    std::visit(Cell{text, column.presentation.format}, row.values[i]);
  }
}

std::string to_csv(const Row& row) {
  std::string line;
  append_csv(line, row);
  return line;
}

Json flag_to_json(const FlagInfo* flag) {
  return Json::object().set("name", flag->name).set("meaning", flag->meaning).set("action", flag->action);
}

Json flags_to_json(const FieldInfo& field, std::uint64_t bits) { return Json::list(flag_names(field, bits)); }

Json to_json(const Value& value) {
  struct Visitor {
    Json operator()(std::monostate) const { return {}; }
    Json operator()(Invalid) const { return {}; }
    Json operator()(Unknown) const { return {}; }
    Json operator()(const Flags& flags) const { return flags_to_json(*flags.field, flags.bits); }
    Json operator()(const ByteVector& bytes) const { return fmt::format("{:02x}", fmt::join(bytes, "")); }
    Json operator()(const std::string& text) const { return text; }
    Json operator()(bool value) const { return value; }
    Json operator()(std::int64_t value) const { return value; }
    Json operator()(std::uint64_t value) const { return value; }
    Json operator()(double value) const { return value; }
  };
  return std::visit(Visitor{}, value);
}

Json to_json(const Row& row) {
  Json json = Json::object();
  for (std::size_t i = 0; i < row.columns.size(); ++i) {
    if (!std::holds_alternative<std::monostate>(row.values[i])) json.set(row.columns[i].name, to_json(row.values[i]));
  }
  return json;
}

Json to_json(const Option& option, std::int64_t value) {
  if (option.decimals != 0) return real_value(option, value);
  if (option.choices.empty()) return value;
  if (option.choices.data() == boolean_choices.data()) return value != 0;
  return option.choices[static_cast<std::size_t>(value)];
}

}  // namespace absenc::client
