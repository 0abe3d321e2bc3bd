// SPDX-License-Identifier: Apache-2.0
// Names, units of measure and meanings of the values in T-format frames and in results of procedures.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/author/bits.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/tformat/frame.hpp"

namespace absenc::tformat {

/// Descriptions of the bits of the status field (SF) of replies (6.3.2), from bit 0 on.
inline constexpr std::array<FlagInfo, 8> status_flags{{
    {"", "", ""},
    {"", "", ""},
    {"", "", ""},
    {"", "", ""},
    {"counting_error", "the position within the turn is wrong", read_the_alarms, false, alarms::counting_error},
    {"alarm", "over-heat, multi-turn error, battery error or battery alarm", read_the_alarms, false,
     alarms::shown_in_status},
    {"parity_error", "the encoder received the request with a parity error", "send the same request again"},
    {"delimiter_error", "the encoder received the request with a wrong stop bit", "send the same request again"},
}};

/// Descriptions of the bits of the alarms (ALMC) in a reply to data ID 3 (6.5), from bit 0 on.
inline constexpr std::array<FlagInfo, 8> alarm_flags{{
    {"over_speed", "the shaft turned faster than the counter follows while the power was off: turns may be wrong",
     "return to the origin, then `absenc reset-multiturn` or `absenc clear-alarms`"},
    {"full_absolute_status", "switched on at 100 rpm or more: only the top 5 bits of the position hold",
     "slow down below 100 rpm and wait until it clears by itself"},
    {"counting_error", "the position within the turn was found wrong",
     "stop the servo system at once; then `absenc clear-alarms`, or switch the encoder off and on"},
    {"counter_overflow", "the turn counter went past its end and goes on from the other one", "`absenc clear-alarms`"},
    {"over_heat", "the encoder is or was hotter than its threshold", "let it cool, then `absenc clear-alarms`"},
    {"multiturn_error", "a bit of the turn counter jumped: turns are wrong",
     "return to the origin, then `absenc reset-multiturn`"},
    {"battery_error", "the battery was below 2.75 V while the power was off: turns are lost",
     "check or replace the battery, return to the origin, then `absenc reset-multiturn`; without a battery set "
     "battery=false",
     true},
    {"battery_alarm", "the battery is below 3.1 V",
     "replace the battery with the encoder switched on; without a battery set battery=false", true},
}};

/// Values of the fields of a frame, or of a procedure's result.
struct Values {
  std::optional<DataId> data_id{};  ///< Data ID of the request or reply.
  /// First byte of the request, the control field (CF): sync code, data ID, parity.
  std::optional<std::uint8_t> control_field{};
  std::optional<std::uint8_t> status{};       ///< Status of the reply (SF), described by `status_flags`.
  std::optional<std::uint32_t> singleturn{};  ///< Position within the turn, in counts (ABS).
  std::optional<std::uint8_t> encoder_id{};   ///< Encoder id (ENID): the kind of encoder.
  std::optional<std::uint32_t> multiturn{};   ///< Number of turns (ABM).
  std::optional<std::uint8_t> alarms{};       ///< Alarms (ALMC), described by `alarm_flags`.
  std::optional<std::uint8_t> page{};         ///< Page of the memory byte that is accessed.
  std::optional<std::uint8_t> address{};      ///< Address of the memory byte that is accessed (ADF).
  std::optional<std::uint8_t> busy{};         ///< 1: the encoder is busy and did not execute the request.
  std::optional<std::uint8_t> value{};        ///< Value of the memory byte (EDF).
  std::optional<Bytes> data{};  ///< Values of several memory bytes, from `address` on, low addresses first.
  std::optional<std::int8_t> temperature{};  ///< Temperature of the board, in degC.
  /// Whether the encoder raises the alarm over_heat above the threshold `overheat_threshold`.
  std::optional<bool> overheat_enabled{};
  std::optional<std::uint8_t> overheat_threshold{};  ///< Temperature above which over_heat is raised, in degC.
  std::optional<bool> written{};  ///< True if the memory byte was written; false if it had the value already.
  /// Memory page that is or may be selected after a procedure; no value: the page from before the procedure is selected
  /// again.
  std::optional<std::uint8_t> page_left{};
};

/// Table of the fields in which requests, replies and results of procedures are reported.
inline constexpr auto fields = [] {
  using author::field;
  using author::in_hex;
  return author::fields_of<Values>(
      field<&Values::data_id>("data_id", "", "which data was asked for (Table 1)", Role::exchange),
      in_hex(field<&Values::control_field>("control_field", "", "first byte of the request: sync code, data id, parity",
                                           Role::exchange)),
      field<&Values::status>("status", "status of the reply (SF)", status_flags),
      field<&Values::singleturn>("singleturn", "counts", "position within the turn, rising counter-clockwise (ABS)",
                                 Role::position),
      in_hex(field<&Values::encoder_id>("encoder_id", "", "which kind of encoder it is (ENID)", Role::identity)),
      field<&Values::multiturn>("multiturn", "revolutions", "turns (ABM)", Role::turns),
      field<&Values::alarms>("alarms", "alarms (ALMC)", alarm_flags), field<&Values::page>("page", "", "memory page"),
      field<&Values::address>("address", "", "ADF: memory address; 127 selects the page"),
      field<&Values::busy>("busy", "", "1 while the encoder writes: the request was not executed"),
      field<&Values::value>("value", "", "EDF: the byte in memory", Role::value),
      field<&Values::data>("data", "", "the bytes in memory from `address` on", Role::data),
      field<&Values::temperature>("temperature_c", "degC", "of the encoder's board, within 3 degC"),
      field<&Values::overheat_enabled>("overheat_enabled", "", "whether over_heat is watched"),
      field<&Values::overheat_threshold>("overheat_threshold_c", "degC", "over_heat above this"),
      field<&Values::written>("written", "", "false when the value was there already", Role::written),
      field<&Values::page_left>(
          "page_left", "",
          "memory page that is left selected, also for whoever reads next: which one was before is not known"));
}();

/// Returns the values of the fields of a request.
[[nodiscard]] constexpr Values values_of(const Request& request) {
  Values all{.data_id = request.id, .control_field = control_field(request.id)};
  if (is_memory_access(request.id)) all.address = request.address;
  if (request.id == DataId::write_memory) all.value = request.value;
  return all;
}

/// Returns the values of the fields of a reply. Without a battery, turns and battery alarms are left out.
[[nodiscard]] constexpr Values values_of(const Format& format, const Reply& reply) {
  if (is_memory_access(reply.id)) {
    return {.data_id = reply.id, .address = reply.address, .busy = reply.busy, .value = reply.value};
  }
  const bool everything = reply.id == DataId::everything;
  Values all{.data_id = reply.id, .status = reply.status};
  if (everything || reply.id == DataId::encoder_id) all.encoder_id = reply.encoder_id;
  if (format.battery && (everything || reply.id == DataId::multiturn)) all.multiturn = reply.multiturn;
  if (everything) all.alarms = static_cast<std::uint8_t>(reply.alarms & ~expected_alarms(format));
  if (reply.id != DataId::multiturn && reply.id != DataId::encoder_id) all.singleturn = reply.singleturn;
  return all;
}

/// Returns the bits of a valid reply that carry `field` (figures of 6.3); no bits if the reply does not carry it.
[[nodiscard]] constexpr BitRanges place_of(const Format& format, Bytes reply, const FieldInfo& field) {
  const DataId id = data_id(reply[0]).value_or(DataId::everything);
  const bool everything = id == DataId::everything;
  using author::bits_of;
  if (&field == fields.of<&Values::data_id>()) return bits_of(0, 3, 4);
  if (&field == fields.of<&Values::status>()) return bits_of(1, 0, 8);
  if (&field == fields.of<&Values::address>()) return bits_of(1, 0, 7);
  if (&field == fields.of<&Values::busy>()) return bits_of(1, 7, 1);
  if (&field == fields.of<&Values::value>()) return bits_of(2, 0, 8);
  if (&field == fields.of<&Values::singleturn>()) return bits_of(2, 0, format.singleturn_bits);
  if (&field == fields.of<&Values::encoder_id>()) return bits_of(everything ? 5 : 2, 0, 8);
  if (&field == fields.of<&Values::multiturn>()) return bits_of(everything ? 6 : 2, 0, format.multiturn_bits);
  if (&field == fields.of<&Values::alarms>()) return bits_of(9, 0, format.battery ? 8 : 6);
  return {};
}

}  // namespace absenc::tformat
