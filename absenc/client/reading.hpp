// SPDX-License-Identifier: Apache-2.0
// What a reading says: flags by their channel, with three states each: reported and clear, reported and raised, not
// reported.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// What one field of flags of the unit says.
struct Flags {
  const FieldInfo* field;                      ///< The field that names the bits; null: none.
  std::uint32_t bits;                          ///< those that are raised
  std::uint32_t reported = ~std::uint32_t{0};  ///< the others are neither raised nor clear: nobody has said

  /// Whether each flag that this encoder has was reported.
  [[nodiscard]] bool is_complete() const;

  /// Compares field and bits.
  friend bool operator==(const Flags&, const Flags&) = default;
};

/// One for each channel that the unit has flags of; none when it has no such field.
[[nodiscard]] std::vector<Flags> alarms_of(const Unit& unit, const Reading& reading);
[[nodiscard]] std::vector<Flags> status_of(const Unit& unit, const Reading& reading);

/// Both, channel by channel.
[[nodiscard]] std::vector<Flags> flags_of(const Unit& unit, const Reading& reading);

/// The alarms of all channels together: raised if one channel raises them, reported if each channel reports them.
/// Nothing when the unit has no alarms.
[[nodiscard]] std::optional<Flags> joined_alarms(const Unit& unit, const Reading& reading);

/// Whether a position that no second one confirmed holds is not known.
[[nodiscard]] Reading checked(Reading reading, bool confirmed);

}  // namespace absenc::client
