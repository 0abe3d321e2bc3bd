// SPDX-License-Identifier: Apache-2.0
// The list of all protocol units.
#include "absenc/protocol/all.hpp"

#include <array>

#include "absenc/protocol/clause.hpp"

// Each line has a unit's folder and the name of its descriptor. ABSENC_UNITS in CMakeLists.txt may replace the list.
// clang-format off
#ifndef ABSENC_UNITS
#define ABSENC_UNITS(one) \
  one(tformat, unit) \
  one(esl, unit) \
  one(encolink, unit) \
  one(encolink, spi_unit) \
  one(biss, unit) \
  one(ssi, unit) \
  one(e201, unit) \
  one(raa38, serial_unit) \
  one(raa38, modbus_unit) \
  one(raa38, can_unit) \
  one(amt21, unit) \
  one(biss, safety_unit) \
  one(biss, chain_unit) \
  one(nikon, unit) \
  one(hiperface, unit) \
  one(endat, unit) \

#endif
// clang-format on

#define DECLARE(folder, name)          \
  namespace folder {                   \
  extern const Unit name;              \
  extern const Clauses name##_clauses; \
  }
#define UNIT(folder, name) &folder::name,
#define CLAUSES(folder, name) &folder::name##_clauses,

namespace absenc {

ABSENC_UNITS(DECLARE)

namespace {

constexpr auto units = std::to_array<const Unit*>({ABSENC_UNITS(UNIT)});
constexpr auto clauses = std::to_array<const Clauses*>({ABSENC_UNITS(CLAUSES)});

const Clauses& listed_clauses(const Unit& unit) {
  static constexpr Clauses none;
  for (std::size_t i = 0; i < units.size(); ++i) {
    if (units[i] == &unit) return *clauses[i];
  }
  return none;
}

}  // namespace

std::span<const Clause> clauses_of(const Unit& unit) { return listed_clauses(unit).encoder; }
std::span<const HostClause> host_clauses_of(const Unit& unit) { return listed_clauses(unit).host; }

std::span<const Unit* const> all_units() { return units; }

const Unit* find_unit(std::string_view id) {
  for (const Unit* unit : units) {
    if (unit->id == id) return unit;
  }
  return nullptr;
}

}  // namespace absenc
