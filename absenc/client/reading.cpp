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

std::vector<Flags> both(const FieldInfo* first, const FieldInfo* second, std::uint32_t bits) {
  std::vector<Flags> flags;
  if (first != nullptr) flags.push_back({first, bits & flag_mask(*first)});
  if (second != nullptr) flags.push_back({second, bits >> first->flags.size()});
  return flags;
}

}  // namespace

std::vector<Flags> alarms_of(const Unit& unit, const Reading& reading) {
  return both(unit.alarms, unit.second_alarms, reading.alarms);
}

std::vector<Flags> status_of(const Unit& unit, const Reading& reading) {
  return both(unit.status, unit.second_status, reading.status);
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
  reading.multiturn_valid = false;
  return reading;
}

}  // namespace absenc::client
