// SPDX-License-Identifier: Apache-2.0
// Flags of a reading by channel. Each flag has one of three states: clear, raised, or not reported.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Flags of one field of the unit.
struct Flags {
  const FieldInfo* field;                      ///< Field that defines the names of the bits; null: none.
  std::uint32_t bits;                          ///< Bits of raised flags.
  std::uint32_t reported = ~std::uint32_t{0};  ///< Bits of reported flags; the state of the others is unknown.

  /// Returns whether each flag of this encoder was reported.
  [[nodiscard]] bool is_complete() const;

  /// Compares field and bits.
  friend bool operator==(const Flags&, const Flags&) = default;
};

/// Returns the alarms of each channel; empty if the unit has no such field.
[[nodiscard]] std::vector<Flags> alarms_of(const Unit& unit, const Reading& reading);
/// Returns the flags of the status of a reading, one entry for each field.
[[nodiscard]] std::vector<Flags> status_of(const Unit& unit, const Reading& reading);

/// Returns status and alarms, channel by channel.
[[nodiscard]] std::vector<Flags> flags_of(const Unit& unit, const Reading& reading);

/// Returns the joined alarms of all channels: raised if one channel raises them, reported if every channel reports
/// them. Returns nothing if the unit has no alarms.
[[nodiscard]] std::optional<Flags> joined_alarms(const Unit& unit, const Reading& reading);

/// Returns the reading; if its position was not confirmed by a second one, the validity of the position becomes
/// unknown.
[[nodiscard]] Reading checked(Reading reading, bool confirmed);

}  // namespace absenc::client
