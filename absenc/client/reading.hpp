// SPDX-License-Identifier: Apache-2.0
// The flags of a reading, by channel.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// States of the flags that one field of a reading reports.
struct Flags {
  const FieldInfo* field;  ///< Field that defines the names of the bits; never null.
  std::uint32_t bits;      ///< Bits of the flags that are raised.
  /// Bits of the flags that were reported; the state of the other flags is unknown.
  std::uint32_t reported = ~std::uint32_t{0};

  /// Returns whether every flag of the field that has a name and is not optional was reported.
  [[nodiscard]] bool is_complete() const;

  /// Returns whether field, raised bits and reported bits are equal.
  friend bool operator==(const Flags&, const Flags&) = default;
};

/// Returns the alarms of a reading, one entry for each channel; empty if the unit has no alarms.
[[nodiscard]] std::vector<Flags> alarms_of(const Unit& unit, const Reading& reading);
/// Returns the status flags of a reading, one entry for each field.
[[nodiscard]] std::vector<Flags> status_of(const Unit& unit, const Reading& reading);

/// Returns the status flags and alarms of a reading.
[[nodiscard]] std::vector<Flags> flags_of(const Unit& unit, const Reading& reading);

/// Returns the alarms of all channels joined; nothing if the unit has no alarms.
[[nodiscard]] std::optional<Flags> joined_alarms(const Unit& unit, const Reading& reading);

/// Returns the reading. If it is not `confirmed`, but its encoder is ready and its position valid, marks the position,
/// and valid turns, as unknown.
[[nodiscard]] Reading checked(Reading reading, bool confirmed);

}  // namespace absenc::client
