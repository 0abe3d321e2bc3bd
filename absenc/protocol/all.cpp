// SPDX-License-Identifier: Apache-2.0
// The only file that includes every unit. A new protocol needs its folder, and here its includes and a line in
// `listed`.
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

// A unit with the clauses of its document. The clauses are not in the unit's descriptor, because firmware links the
// descriptor and tests nothing.
struct Listed {
  const Unit* unit;
  std::span<const Clause> clauses{};
  std::span<const HostClause> host_clauses{};
};

constexpr auto listed = std::array{
    Listed{&tformat::unit, tformat::clauses, tformat::host_clauses},
    Listed{&esl::unit, esl::clauses, esl::host_clauses},
    Listed{&encolink::unit, encolink::clauses, encolink::host_clauses},
    Listed{&encolink::spi_unit, encolink::spi_clauses, encolink::spi_host_clauses},
    Listed{&biss::unit, biss::clauses, biss::host_clauses},
    Listed{&ssi::unit, ssi::clauses, ssi::host_clauses},
    Listed{&e201::unit, e201::clauses, e201::host_clauses},
    Listed{&raa38::serial_unit, raa38::serial_clauses, raa38::serial_host_clauses},
    Listed{&raa38::modbus_unit, raa38::modbus_clauses, raa38::modbus_host_clauses},
    Listed{&raa38::can_unit, raa38::can_clauses, raa38::can_host_clauses},
    Listed{&amt21::unit, amt21::clauses, amt21::host_clauses},
    Listed{&biss::safety_unit, biss::safety_clauses, biss::host_clauses},
    Listed{&biss::chain_unit, biss::chain_clauses, biss::host_clauses},
};

constexpr auto units = [] {
  std::array<const Unit*, listed.size()> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = listed[i].unit;
  return all;
}();

Listed listed_as(const Unit& unit) {
  for (const Listed& one : listed) {
    if (one.unit == &unit) return one;
  }
  return {};
}

}  // namespace

std::span<const Clause> clauses_of(const Unit& unit) { return listed_as(unit).clauses; }
std::span<const HostClause> host_clauses_of(const Unit& unit) { return listed_as(unit).host_clauses; }

std::span<const Unit* const> all_units() { return units; }

const Unit* find_unit(std::string_view id) {
  for (const Unit* unit : units) {
    if (unit->id == id) return unit;
  }
  return nullptr;
}

}  // namespace absenc
