// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/protocol/all.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

// Returns the options of a vector, which are stored as a text "name=value name=value".
std::vector<OptionText> vector_settings(const Vector& vector) {
  std::vector<OptionText> settings;
  std::string_view rest = vector.options;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    if (end > 0) settings.push_back(split_setting(rest.substr(0, end)));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return settings;
}

// Returns the frame of a reference vector, which stores it as bytes, or as the text of a CAN frame or clocked word.
WireFrame vector_frame(const Unit& unit, Bytes bytes) {
  if (bytes.empty()) return {};
  if (unit.link != LinkKind::can && !carries_bits(unit.link)) return {{bytes.begin(), bytes.end()}, 0, {}};
  return parse_wire_text(unit.link, "vector", std::string(bytes.begin(), bytes.end()));
}

struct Comparison final : FieldSink {
  explicit Comparison(const Vector& wanted) : vector(wanted) {}
  void put(const FieldValue& value) override {
    decoded.set(value.info->name, to_json(value_of(value)));
    for (const Expected& expected : vector.fields) {
      if (expected.field == value.info->name && expected.number == value.number &&
          std::abs(expected.real - value.real) < 1e-9) {
        ++matches;
      }
    }
  }
  const Vector& vector;
  std::size_t matches = 0;
  Json decoded = Json::object();
};

const FieldInfo* find_field(const Unit& unit, std::string_view name) {
  for (const FieldInfo& field : unit.fields) {
    if (field.name == name) return &field;
  }
  return nullptr;
}

Json expected_fields(const Unit& unit, const Vector& vector) {
  Json fields = Json::object();
  for (const Expected& expected : vector.fields) {
    const FieldInfo* info = find_field(unit, expected.field);
    const std::vector<std::uint8_t> text(expected.text.begin(), expected.text.end());
    const FieldValue value{.info = info, .number = expected.number, .real = expected.real, .bytes = text};
    fields.set(expected.field, info != nullptr ? to_json(value_of(value)) : Json(expected.number));
  }
  return fields;
}

Json vector_json(const Unit& unit, const Vector& vector) {
  Json settings = Json::object();
  const Options options = require_options(unit, {}, vector_settings(vector));
  for (const OptionText& setting : vector_settings(vector)) {
    const auto option = std::find_if(unit.options.begin(), unit.options.end(),
                                     [&](const Option& one) { return one.name == setting.name; });
    const auto index = static_cast<std::size_t>(option - unit.options.begin());
    settings.set(setting.name, client::to_json(*option, options[index]));
  }
  Json json = Json::object();
  json.set("id", vector.id).set("protocol", unit.id).set("description", vector.meaning);
  json.set("source", vector.source).set("options", settings);
  json.set("request", to_compact_wire_text(unit.link, vector_frame(unit, vector.request).frame()));
  json.set("response", to_compact_wire_text(unit.link, vector_frame(unit, vector.reply).frame()));
  if (vector.error != Error::none) return json.set("error", text_of(vector.error).name);
  return json.set("fields", expected_fields(unit, vector));
}

bool holds(const Unit& unit, const Vector& vector) {
  const WireFrame request = vector_frame(unit, vector.request);
  const WireFrame reply = vector_frame(unit, vector.reply);
  Comparison comparison(vector);
  const Options options = require_options(unit, {}, vector_settings(vector));
  const Error error = unit.decode(options, request.frame(), reply.frame(), comparison);
  return error == vector.error && comparison.matches == vector.fields.size();
}

int run_vectors(const Invocation& invocation) {
  std::vector<const Unit*> units(all_units().begin(), all_units().end());
  if (invocation.has("protocol")) units = {&require_unit(invocation.text("protocol"))};
  std::vector<std::vector<std::string>> rows{{"ID", "", "REQUEST", "REPLY", "RESULT", "WHAT"}};
  bool good = true;
  for (const Unit* unit : units) {
    for (const Vector& vector : unit->vectors) {
      if (invocation.has("--json")) {
        print_line(vector_json(*unit, vector).line());
        continue;
      }
      const bool ok = holds(*unit, vector);
      good = good && ok;
      rows.push_back({std::string(vector.id), ok ? "ok" : "WRONG",
                      to_compact_wire_text(unit->link, vector_frame(*unit, vector.request).frame()),
                      to_compact_wire_text(unit->link, vector_frame(*unit, vector.reply).frame()),
                      vector.error == Error::none ? "good" : std::string(text_of(vector.error).name),
                      std::string(vector.meaning)});
    }
  }
  if (!invocation.has("--json")) print_line(table(rows));
  return good ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 2> vectors_parameters{{
    {"protocol", "", "only those of this one"},
    {"--json", "", "one JSON object a line, one line for each vector"},
}};

constexpr std::array<Example, 2> vectors_examples{{
    {"absenc vectors tformat", "frames to test an own implementation with, each decoded on the spot"},
    {"absenc vectors --json > vectors.json", "all of them, for a program"},
}};

}  // namespace

const Subcommand vectors_subcommand{
    "vectors",  "print reference frames with what they must decode to", "", vectors_parameters, vectors_examples,
    run_vectors};

}  // namespace absenc::tool
