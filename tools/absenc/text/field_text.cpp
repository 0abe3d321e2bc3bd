// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text/field_text.hpp"
#include "absenc/client/text/unit_text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace absenc::tool {

Json options_to_json(const Unit& unit, const Options& options) {
  Json json = Json::object();
  if (options.has_word()) json.set(word_option_name, to_text(options.word));
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    if (options.has_word() && unit.options[i].describes_word) continue;
    json.set(unit.options[i].name, client::to_json(unit.options[i], options[i]));
  }
  return json;
}

void JsonFields::put(const FieldValue& value) {
  fields.set(value.info->name, to_json(value_of(value)));
  if (is_of_reading(value.info->role)) judged_.push_back({value.info, Validity::valid});
}

void JsonFields::put_reading(const Reading& reading) {
  for (ValidatedField& judged : judged_) {
    const Validity validity = validity_of(*judged.info, reading);
    if (judged.validity == Validity::valid || validity == Validity::invalid) judged.validity = validity;
    if (judged.validity == Validity::valid) continue;
    fields.set(fmt::format("{}_valid", judged.info->name), to_json(client::value_of(judged.validity)));
  }
}

namespace {

// Returns the meaning of a flag and, if there is one, the action that it requires of the user (action_of).
std::string in_words(const FlagInfo& flag, bool beside_alarms) {
  const std::string_view action = action_of(flag, beside_alarms);
  return action.empty() ? std::string(flag.meaning) : fmt::format("{}: {}", flag.meaning, action);
}

}  // namespace

void FieldTable::put(const FieldValue& value) {
  const FieldInfo& info = *value.info;
  std::string shown = to_text(value);
  if (!info.unit.empty()) shown += fmt::format(" {}", info.unit);
  if (is_of_reading(info.role)) judged_.push_back({&info, rows.size()});
  rows.push_back({std::string(info.name), shown, std::string(info.meaning)});
  if (info.kind == FieldInfo::Kind::flags) put_flags(info, static_cast<std::uint64_t>(value.number));
}

// Makes a row for each set flag. If alarms have rows of their own, no row advises the user to read the alarms.
void FieldTable::put_flags(const FieldInfo& field, std::uint64_t bits) {
  const auto sums_up = [](const FlagInfo& flag) { return flag.action == read_the_alarms; };
  if (bits != 0 && std::none_of(field.flags.begin(), field.flags.end(), sums_up)) {
    shows_alarms_ = true;
    for (const auto& [row, flag] : sends_to_alarms_) rows[row][2] = in_words(*flag, true);
    sends_to_alarms_.clear();
  }
  for (const FlagInfo* flag : raised(field, bits)) {
    if (sums_up(*flag) && !shows_alarms_) sends_to_alarms_.push_back({rows.size(), flag});
    rows.push_back({fmt::format("  {}", flag->name), "", in_words(*flag, shows_alarms_)});
  }
}

std::vector<std::vector<std::string>> to_table(const Row& row) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < row.columns.size(); ++i) {
    const Column& column = row.columns[i];
    rows.push_back({std::string(column.name), to_text(column, row.values[i]), std::string(column.meaning)});
    const auto* const flags = std::get_if<Flags>(&row.values[i]);
    if (flags == nullptr) continue;
    for (const FlagInfo* flag : raised(*flags->field, flags->bits)) {
      rows.push_back({fmt::format("  {}", flag->name), "", in_words(*flag, false)});
    }
  }
  return rows;
}

void FieldTable::put_reading(const Reading& reading) {
  std::erase_if(judged_, [&](const ValidatedRow& judged) {
    if (holds(*judged.info, reading)) return false;
    rows[judged.row][1] = marked(*judged.info, rows[judged.row][1], reading);
    return true;  // the row is marked as invalid now, so it leaves `judged_` and a later reading does not mark it again
  });
}

}  // namespace absenc::tool
