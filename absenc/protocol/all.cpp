// SPDX-License-Identifier: Apache-2.0
// The only file that includes every unit: adding a protocol is its folder and one line here.
#include "absenc/protocol/all.hpp"

#include <array>

#include "absenc/protocol/amt21/clauses.hpp"
#include "absenc/protocol/amt21/unit.hpp"
#include "absenc/protocol/biss/clauses.hpp"
#include "absenc/protocol/biss/unit.hpp"
#include "absenc/protocol/e201/clauses.hpp"
#include "absenc/protocol/e201/unit.hpp"
#include "absenc/protocol/encolink/clauses.hpp"
#include "absenc/protocol/encolink/unit.hpp"
#include "absenc/protocol/esl/clauses.hpp"
#include "absenc/protocol/esl/unit.hpp"
#include "absenc/protocol/raa38/clauses.hpp"
#include "absenc/protocol/raa38/unit.hpp"
#include "absenc/protocol/ssi/clauses.hpp"
#include "absenc/protocol/ssi/unit.hpp"
#include "absenc/protocol/tformat/clauses.hpp"
#include "absenc/protocol/tformat/unit.hpp"

namespace absenc {

namespace {
constexpr std::array units{
    &tformat::unit, &esl::unit,         &encolink::unit,     &encolink::spi_unit, &biss::unit,
    &ssi::unit,     &e201::unit,        &raa38::serial_unit, &raa38::modbus_unit, &raa38::can_unit,
    &amt21::unit,   &biss::safety_unit, &biss::chain_unit,
};
}  // namespace

// Not in the descriptor: firmware, which keeps that, tests no encoder.
std::span<const Clause> clauses_of(const Unit& unit) {
  if (&unit == &tformat::unit) return tformat::clauses;
  if (&unit == &esl::unit) return esl::clauses;
  if (&unit == &encolink::unit) return encolink::clauses;
  if (&unit == &encolink::spi_unit) return encolink::spi_clauses;
  if (&unit == &biss::unit) return biss::clauses;
  if (&unit == &ssi::unit) return ssi::clauses;
  if (&unit == &e201::unit) return e201::clauses;
  if (&unit == &raa38::serial_unit) return raa38::serial_clauses;
  if (&unit == &raa38::modbus_unit) return raa38::modbus_clauses;
  if (&unit == &raa38::can_unit) return raa38::can_clauses;
  if (&unit == &amt21::unit) return amt21::clauses;
  return {};
}

std::span<const Unit* const> all_units() { return units; }

const Unit* find_unit(std::string_view id) {
  for (const Unit* unit : units) {
    if (unit->id == id) return unit;
  }
  return nullptr;
}

}  // namespace absenc
