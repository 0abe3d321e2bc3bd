// SPDX-License-Identifier: Apache-2.0
// What a reading says: flags by their channel, and which of its fields hold.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// What one field of flags of the unit says.
struct Flags {
  const FieldInfo* field;
  std::uint32_t bits;

  friend bool operator==(const Flags&, const Flags&) = default;
};

/// One for each channel that the unit has flags of; none when it has no such field.
[[nodiscard]] std::vector<Flags> alarms_of(const Unit& unit, const Reading& reading);
[[nodiscard]] std::vector<Flags> status_of(const Unit& unit, const Reading& reading);

/// Both, channel by channel.
[[nodiscard]] std::vector<Flags> flags_of(const Unit& unit, const Reading& reading);

/// A position that no second one confirmed is not valid.
[[nodiscard]] Reading checked(Reading reading, bool confirmed);

}  // namespace absenc::client
