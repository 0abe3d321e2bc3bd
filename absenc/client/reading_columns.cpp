// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/reading_columns.hpp"

#include "absenc/core/angle.hpp"

namespace absenc::client {

namespace {

bool has_channels(const Unit& unit) { return unit.second_status != nullptr || unit.second_alarms != nullptr; }

constexpr std::string_view flag_words =
    "names, separated by spaces; none: all are clear; empty: nobody has reported whether";

}  // namespace

ReadingColumns::ReadingColumns(const Unit& unit, const Options& options) : unit_(&unit) {
  const bool is_linear = unit.resolution(options).unit_um > 0;
  if (is_linear) {
    columns_ = {{"position_mm", "mm", ColumnType::real, "millimetres, empty when not valid"},
                {"position_um", "um", ColumnType::real, "micrometres, empty when not valid"}};
  } else {
    columns_ = {{"angle_deg", "deg", ColumnType::real, "degrees within the turn, empty when not valid"}};
  }
  const Column numbers[] = {
      {"singleturn", "counts", ColumnType::uint64, "counts"},
      {"singleturn_bits", "", ColumnType::uint64, "", {.is_detail = true}},
      {"singleturn_valid", "", ColumnType::boolean, ""},
      {"singleturn_valid_bits", "", ColumnType::uint64, "", {.is_detail = true}},
      {"multiturn", "revolutions", ColumnType::int64, "revolutions as the encoder counts them"},
      {"multiturn_bits", "", ColumnType::uint64, "", {.is_detail = true}},
      {"multiturn_valid", "", ColumnType::boolean, ""},
  };
  columns_.insert(columns_.end(), std::begin(numbers), std::end(numbers));
  if (has_channels(unit)) {
    for (const Flags& flags : flags_of(unit, {}))
      columns_.push_back({flags.field->name, "", ColumnType::flags, flag_words});
    columns_.push_back({"alarms", "", ColumnType::flags, flag_words, {.is_detail = true}});
  } else {
    columns_.push_back({"status", "", ColumnType::flags, flag_words});
    columns_.push_back({"alarms", "", ColumnType::flags, flag_words});
  }
}

void ReadingColumns::fill(const Reading& reading, std::span<Value> values) const {
  std::size_t at = 0;
  const auto put = [&](bool is_carried, Value value) { values[at++] = is_carried ? std::move(value) : Value(); };
  const bool has_position = reading.singleturn_bits != 0;
  const Validity validity = reading.ready || !has_position ? reading.singleturn_validity() : Validity::invalid;
  const bool is_valid = validity == Validity::valid;
  const auto put_position = [&](double position) { put(has_position, is_valid ? Value(position) : Value(Invalid{})); };
  if (columns_.front().name == "position_mm") {
    const double um = has_position ? micrometres(reading.singleturn, reading.unit_um) : 0;
    put_position(um / 1000);
    put_position(um);
  } else {
    put_position(has_position ? degrees(reading.singleturn, reading.singleturn_bits) : 0);
  }
  put(has_position, reading.singleturn);
  put(has_position, std::uint64_t{reading.singleturn_bits});
  put(has_position, value_of(validity));
  put(has_position, std::uint64_t{reading.singleturn_valid_bits});
  const bool has_turns = reading.multiturn_bits != 0;
  put(has_turns, reading.turns());
  put(has_turns, std::uint64_t{reading.multiturn_bits});
  put(has_turns, value_of(reading.multiturn_validity()));

  const auto put_flags = [&](const std::optional<Flags>& flags) {
    put(flags.has_value(), flags ? value_of(*flags) : Value());
  };
  if (has_channels(*unit_)) {
    for (const Flags& flags : flags_of(*unit_, reading)) put_flags(flags);
  } else {
    const std::vector<Flags> status = status_of(*unit_, reading);
    put_flags(status.empty() ? std::nullopt : std::optional(status.front()));
  }
  put_flags(joined_alarms(*unit_, reading));
}

}  // namespace absenc::client
