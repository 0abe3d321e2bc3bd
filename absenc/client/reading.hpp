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
};

/// One for each channel that the unit has flags of; none when it has no such field.
[[nodiscard]] std::vector<Flags> alarms_of(const Unit& unit, const Reading& reading);
[[nodiscard]] std::vector<Flags> status_of(const Unit& unit, const Reading& reading);

/// A position that no second one confirmed is not valid.
[[nodiscard]] Reading checked(Reading reading, bool confirmed);

/// Hands fields on, and keeps the reading that says which of them hold.
class FieldsWithReading final : public FieldSink {
 public:
  explicit FieldsWithReading(FieldSink& sink) : sink_(sink) {}
  void put(const FieldValue& value) override {
    names_.push_back(value.info);
    sink_.put(value);
  }
  void put_reading(const Reading& one) override { reading_ = one; }

  [[nodiscard]] const std::optional<Reading>& reading() const { return reading_; }
  /// The fields that do not hold.
  [[nodiscard]] std::vector<std::string_view> invalid() const;

 private:
  FieldSink& sink_;
  std::vector<const FieldInfo*> names_;
  std::optional<Reading> reading_;
};

}  // namespace absenc::client
