// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/reading.hpp"

#include <algorithm>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/core/bits.hpp"

namespace absenc::client {

namespace {

std::uint32_t flag_mask(const FieldInfo& field) {
  return static_cast<std::uint32_t>(low_mask(static_cast<unsigned>(field.flags.size())));
}

std::uint32_t required(const FieldInfo& field) {
  std::uint32_t mask = 0;
  for (std::size_t i = 0; i < field.flags.size(); ++i) {
    if (!field.flags[i].name.empty() && !field.flags[i].optional) mask |= std::uint32_t{1} << i;
  }
  return mask;
}

std::vector<Flags> both(const FieldInfo* first, const FieldInfo* second, std::uint32_t bits, std::uint32_t reported) {
  std::vector<Flags> flags;
  if (first != nullptr) flags.push_back({first, bits & flag_mask(*first), reported & flag_mask(*first)});
  if (second != nullptr) flags.push_back({second, bits >> first->flags.size(), reported >> first->flags.size()});
  return flags;
}

}  // namespace

bool Flags::is_complete() const { return (required(*field) & ~reported) == 0; }

std::vector<Flags> alarms_of(const Unit& unit, const Reading& reading) {
  return both(unit.alarms, unit.second_alarms, reading.alarms, reading.alarms_reported);
}

std::vector<Flags> status_of(const Unit& unit, const Reading& reading) {
  return both(unit.status, unit.second_status, reading.status, reading.status_reported);
}

std::optional<Flags> joined_alarms(const Unit& unit, const Reading& reading) {
  const std::vector<Flags> channels = alarms_of(unit, reading);
  if (channels.empty()) return std::nullopt;
  Flags joined = channels.front();
  for (const Flags& flags : channels) {
    joined.bits |= flags.bits;
    joined.reported &= flags.reported;
  }
  return joined;
}

std::vector<Flags> flags_of(const Unit& unit, const Reading& reading) {
  const std::vector<Flags> status = status_of(unit, reading);
  const std::vector<Flags> alarms = alarms_of(unit, reading);
  std::vector<Flags> all;
  for (std::size_t i = 0; i < std::max(status.size(), alarms.size()); ++i) {
    if (i < status.size()) all.push_back(status[i]);
    if (i < alarms.size()) all.push_back(alarms[i]);
  }
  return all;
}

Reading checked(Reading reading, bool confirmed) {
  if (confirmed || !reading.ready || !reading.singleturn_valid()) return reading;
  reading.singleturn_valid_bits = 0;
  reading.singleturn_known = false;
  // invalid turns do not become unknown, because the encoder has reported that they are invalid
  if (reading.multiturn_valid) reading.multiturn_known = false;
  reading.multiturn_valid = false;
  return reading;
}

}  // namespace absenc::client
