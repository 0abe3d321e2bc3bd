// SPDX-License-Identifier: Apache-2.0
// What a unit's document demands of an encoder, clause by clause, as data: how it is tested is the same for every unit.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace absenc {

/// What is looked at. All of it is seen by reading: nothing changes the encoder.
enum class Demand : std::uint8_t {
  answered,         // each request of a reading gets a reply
  in_time,          // the reply begins within the time that the unit waits for it
  whole,            // replies have the length of the document
  checked,          // their checksum is right
  as_drawn,         // fixed bits, echoes, ranges, and what must agree
  foreign_silent,   // a request to another address is not answered
  damaged_silent,   // nor is one whose last byte has a wrong bit
  unknown_silent,   // nor is `request`
  unknown_reported  // `request` gets a reply of `reply_size` bytes
};

struct Clause {
  std::string_view id;         // unique in its unit: "crc"
  std::string_view paragraph;  // of the unit's document
  std::string_view words;
  Demand demand;
  std::uint8_t request = 0;     // a whole request of one byte
  std::uint8_t reply_size = 0;  // to it
  std::string_view option{};    // with which it is read for this; "": as the user has it
  std::int64_t value = 0;       // of this option
};

struct Unit;
/// Those of this unit, in the order in which they are tested; empty: none are known. Defined with the list of units.
[[nodiscard]] std::span<const Clause> clauses_of(const Unit& unit);

}  // namespace absenc
