// SPDX-License-Identifier: Apache-2.0
// The only file that includes every unit: adding a protocol is its folder and one line here.
#include "absenc/protocol/all.hpp"

#include <array>

#include "absenc/protocol/amt21/unit.hpp"
#include "absenc/protocol/biss/unit.hpp"
#include "absenc/protocol/e201/unit.hpp"
#include "absenc/protocol/encolink/unit.hpp"
#include "absenc/protocol/esl/unit.hpp"
#include "absenc/protocol/raa38/unit.hpp"
#include "absenc/protocol/ssi/unit.hpp"
#include "absenc/protocol/tformat/unit.hpp"

namespace absenc {

namespace {
constexpr std::array units{
    &tformat::unit, &esl::unit,         &encolink::unit,     &encolink::spi_unit, &biss::unit,
    &ssi::unit,     &e201::unit,        &raa38::serial_unit, &raa38::modbus_unit, &raa38::can_unit,
    &amt21::unit,   &biss::safety_unit, &biss::chain_unit,
};
}  // namespace

std::span<const Unit* const> all_units() { return units; }

const Unit* find_unit(std::string_view id) {
  for (const Unit* unit : units) {
    if (unit->id == id) return unit;
  }
  return nullptr;
}

}  // namespace absenc
