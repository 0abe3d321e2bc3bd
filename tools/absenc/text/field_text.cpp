// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text/field_text.hpp"
#include "absenc/client/text/unit_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace absenc::tool {

Json to_json(const Option& option, std::int64_t value) {
  if (option.decimals != 0) return real_value(option, value);
  if (option.choices.empty()) return value;
  if (option.choices.data() == boolean_choices.data()) return value != 0;
  return option.choices[static_cast<std::size_t>(value)];
}

Json options_to_json(const Unit& unit, const Options& options) {
  Json json = Json::object();
  if (options.has_word()) json.set(word_option_name, to_text(options.word));
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    if (options.has_word() && unit.options[i].describes_word) continue;
    json.set(unit.options[i].name, to_json(unit.options[i], options[i]));
  }
  return json;
}

Json flags_to_json(const FieldInfo& field, std::uint64_t bits) {
  Json names = Json::array();
  for (const std::string_view name : flag_names(field, bits)) names.append(name);
  return names;
}

Json to_json(const Value& value) {
  struct Visitor {
    Json operator()(std::monostate) const { return {}; }
    Json operator()(Invalid) const { return {}; }
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

void JsonFields::put(const FieldValue& value) {
  fields.set(value.info->name, to_json(value_of(value)));
  if (is_of_reading(value.info->role)) judged_.push_back({value.info, true});
}

void JsonFields::put_reading(const Reading& reading) {
  for (Judged& judged : judged_) {
    judged.holds = judged.holds && holds(*judged.info, reading);
    if (!judged.holds) fields.set(fmt::format("{}_valid", judged.info->name), false);
  }
}

void FieldTable::put(const FieldValue& value) {
  const FieldInfo& info = *value.info;
  std::string shown = to_text(value);
  if (!info.unit.empty()) shown += fmt::format(" {}", info.unit);
  if (is_of_reading(info.role)) judged_.push_back({&info, rows.size()});
  rows.push_back({std::string(info.name), shown, std::string(info.meaning)});
  if (info.kind == FieldInfo::Kind::flags) add_flags(rows, info, static_cast<std::uint64_t>(value.number));
}

void add_flags(std::vector<std::vector<std::string>>& rows, const FieldInfo& field, std::uint64_t bits) {
  for (std::size_t i = 0; i < field.flags.size(); ++i) {
    const FlagInfo& flag = field.flags[i];
    if ((bits >> i & 1) == 0 || flag.name.empty()) continue;
    std::string words(flag.meaning);
    if (!flag.action.empty()) words += fmt::format(": {}", flag.action);
    rows.push_back({fmt::format("  {}", flag.name), "", words});
  }
}

void FieldTable::put_reading(const Reading& reading) {
  std::erase_if(judged_, [&](const Judged& judged) {
    if (holds(*judged.info, reading)) return false;
    rows[judged.row][1] = marked(*judged.info, rows[judged.row][1], reading);
    return true;  // once
  });
}

}  // namespace absenc::tool
