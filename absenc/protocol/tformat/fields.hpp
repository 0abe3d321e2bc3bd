// SPDX-License-Identifier: Apache-2.0
// Names, units and meanings of everything in a T-format frame, in words for the person in front of the machine.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/tformat/frame.hpp"

namespace absenc::tformat {

// 6.3.2
inline constexpr std::array<FlagInfo, 8> status_flags{{
    {"", "", ""},
    {"", "", ""},
    {"", "", ""},
    {"", "", ""},
    {"counting_error", "the position within the turn is wrong", "read the alarms (data ID 3)"},
    {"alarm", "over-heat, multi-turn error, battery error or battery alarm", "read the alarms (data ID 3)"},
    {"parity_error", "the encoder received the request with a parity error", "send the same request again"},
    {"delimiter_error", "the encoder received the request with a wrong stop bit", "send the same request again"},
}};

// 6.5
inline constexpr std::array<FlagInfo, 8> alarm_flags{{
    {"over_speed", "the shaft turned faster than the counter follows while the power was off: turns may be wrong",
     "return to the origin, then reset-multiturn or clear-alarms"},
    {"full_absolute_status", "switched on at 100 rpm or more: only the top 5 bits of the position hold",
     "slow down below 100 rpm and wait until it clears by itself"},
    {"counting_error", "the position within the turn was found wrong",
     "stop the servo system at once; then clear-alarms, or switch the encoder off and on"},
    {"counter_overflow", "the turn counter went past its end and goes on from the other one", "clear-alarms"},
    {"over_heat", "the encoder is or was hotter than its threshold", "let it cool, then clear-alarms"},
    {"multiturn_error", "a bit of the turn counter jumped: turns are wrong",
     "return to the origin, then reset-multiturn"},
    {"battery_error", "the battery was below 2.75 V while the power was off: turns are lost",
     "check or replace the battery, return to the origin, then reset-multiturn"},
    {"battery_alarm", "the battery is below 3.1 V", "replace the battery with the encoder switched on"},
}};

/// What a frame or a procedure shows; in the order of the wire.
struct Values {
  std::optional<DataId> data_id{};
  std::optional<std::uint8_t> control_field{};
  std::optional<std::uint8_t> status{};
  std::optional<std::uint32_t> singleturn{};
  std::optional<std::uint8_t> encoder_id{};
  std::optional<std::uint32_t> multiturn{};
  std::optional<std::uint8_t> alarms{};
  std::optional<std::uint8_t> page{};
  std::optional<std::uint8_t> address{};
  std::optional<bool> busy{};
  std::optional<std::uint8_t> value{};
  std::optional<Bytes> data{};
  std::optional<std::int8_t> temperature{};
  std::optional<bool> overheat_enabled{};
  std::optional<std::uint8_t> overheat_threshold{};
  std::optional<bool> written{};
  std::optional<std::uint8_t> page_left{};
};

inline constexpr auto fields = [] {
  using author::field;
  using enum FieldInfo::Kind;
  return author::fields_of<Values>(
      field<&Values::data_id>({"data_id", number, "", "which data was asked for (Table 1)"}),
      field<&Values::control_field>(
          {"control_field", number, "", "first byte of the request: sync code, data id, parity"}),
      field<&Values::status>({"status", flags, "", "SF", status_flags}),
      field<&Values::singleturn>({"singleturn",
                                  number,
                                  "counts",
                                  "ABS: position within the turn, rising counter-clockwise",
                                  {},
                                  Shows::position}),
      field<&Values::encoder_id>({"encoder_id", number, "", "ENID"}),
      field<&Values::multiturn>({"multiturn", number, "revolutions", "ABM", {}, Shows::turns}),
      field<&Values::alarms>({"alarms", flags, "", "ALMC", alarm_flags}),
      field<&Values::page>({"page", number, "", "memory page"}),
      field<&Values::address>({"address", number, "", "ADF: memory address; 127 selects the page"}),
      field<&Values::busy>({"busy", number, "", "1 while the encoder writes: the request was not executed"}),
      field<&Values::value>({"value", number, "", "EDF: the byte in memory"}),
      field<&Values::data>({"data", bytes, "", "the bytes in memory from `address` on"}),
      field<&Values::temperature>({"temperature_c", number, "degC", "of the encoder's board, within 3 degC"}),
      field<&Values::overheat_enabled>({"overheat_enabled", boolean, "", "whether over_heat is watched"}),
      field<&Values::overheat_threshold>({"overheat_threshold_c", number, "degC", "over_heat above this"}),
      field<&Values::written>({"written", boolean, "", "false when the value was there already"}),
      field<&Values::page_left>(
          {"page_left", number, "",
           "memory page that is left selected, also for whoever reads next: which one was before is not known"}));
}();

[[nodiscard]] constexpr Values values_of(const Request& request) {
  Values all{.data_id = request.id, .control_field = control_field(request.id)};
  if (is_memory_access(request.id)) all.address = request.address;
  if (request.id == DataId::write_memory) all.value = request.value;
  return all;
}

[[nodiscard]] constexpr Values values_of(const Reply& reply) {
  if (is_memory_access(reply.id)) {
    return {.data_id = reply.id, .address = reply.address, .busy = reply.busy, .value = reply.value};
  }
  Values all{.data_id = reply.id, .status = reply.status};
  const bool everything = reply.id == DataId::everything;
  if (everything || reply.id == DataId::encoder_id) all.encoder_id = reply.encoder_id;
  if (everything || reply.id == DataId::multiturn) all.multiturn = reply.multiturn;
  if (everything) all.alarms = reply.alarms;
  if (reply.id != DataId::multiturn && reply.id != DataId::encoder_id) all.singleturn = reply.singleturn;
  return all;
}

}  // namespace absenc::tformat
