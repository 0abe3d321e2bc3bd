// SPDX-License-Identifier: Apache-2.0
// A position reading for people, as JSON and as CSV. What is not valid never looks like a good number.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/angle.hpp"
#include "absenc/protocol/unit.hpp"
#include "tools/absenc/json.hpp"

namespace absenc::tool {

/// " 204.800 deg   74565 counts   4660 turns   alarms: over_heat"; of a linear encoder
/// "  78.96355 mm      78963.55 um   1579271 counts   no alarms"
[[nodiscard]] std::string to_text(const Unit& unit, const Reading& reading);

/// What each flag that is set means and what to do, a line each; "" when there is none, or no such field.
[[nodiscard]] std::string flags_in_words(const FieldInfo* field, std::uint32_t bits);
[[nodiscard]] std::string alarms_in_words(const Unit& unit, const Reading& reading);

/// Sets everything but the time.
void set_reading(Json& json, const Unit& unit, const Reading& reading, bool confirmed);
[[nodiscard]] Json to_json(const Unit& unit, const Reading& reading, double seconds, bool confirmed);

/// Whether the value of a field holds, by the reading that its frame makes: positions as the single turn does, the
/// turns as they do; nothing is said against others.
[[nodiscard]] bool holds(const FieldInfo& field, const Reading& reading);
/// Sets singleturn_valid and multiturn_valid, as far as the reading carries them.
void set_validity(Json& json, const Reading& reading);

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

/// In rows of name and value, as FieldTable has them: "INVALID (74565)" where a value does not hold.
void mark_invalid(std::vector<std::vector<std::string>>& rows, std::span<const std::string_view> invalid);

/// A position that no second one confirmed is not valid.
[[nodiscard]] Reading checked(Reading reading, bool confirmed);

/// "0.125" without more decimals than the unit of a count has.
[[nodiscard]] std::string millimetres_text(double millimetres, double unit_um);

inline constexpr std::string_view csv_header =
    "time_s,angle_deg,singleturn,singleturn_valid,multiturn,multiturn_valid,status,alarms";
inline constexpr std::string_view linear_csv_header =
    "time_s,position_mm,position_um,singleturn,singleturn_valid,multiturn,multiturn_valid,status,alarms";
/// Flags are separated by spaces; what the reply does not carry is empty, and so is what is not valid in degrees or
/// millimetres.
[[nodiscard]] std::string to_csv(const Unit& unit, const Reading& reading, double seconds);

}  // namespace absenc::tool
