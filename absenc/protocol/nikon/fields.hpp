// SPDX-License-Identifier: Apache-2.0
// Names, units of measure and meanings of the values in frames of Nikon's A-format.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/author/bits.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/nikon/protocol.hpp"

namespace absenc::nikon {

/// Descriptions of the bits of the alarms (ALM), from bit 0 on.
inline constexpr std::array<FlagInfo, 11> alarm_flags{{
    {"battery", "the battery's voltage is low",
     "replace the battery with the encoder switched on, then `absenc clear-alarms`"},
    {"multiturn_error", "battery and capacitor were empty: the turns are lost",
     "replace the battery, return to the origin, then `absenc reset-multiturn`"},
    {"overflow", "the turn counter went past its end and goes on from the other one", "`absenc clear-alarms`"},
    {"over_speed", "the shaft turned too fast: position and turns may be wrong",
     "return to the origin, then `absenc reset-multiturn`"},
    {"memory_error", "an access to the EEPROM failed", "`absenc clear-alarms`; if it comes back, replace the encoder"},
    {"singleturn_error", "absolute and incremental position differ",
     "stop the servo system at once; then `absenc clear-alarms`"},
    {"ps_error", "position within the turn and turns do not fit together",
     "stop the servo system at once, return to the origin, then `absenc reset-multiturn`"},
    {"busy", "the encoder still determines its position", "wait; if it stays, `absenc clear-alarms`"},
    {"memory_busy", "the EEPROM is being read or written", "wait until it is over"},
    {"over_temperature", "the encoder is or was too hot", "let it cool, then `absenc clear-alarms`"},
    {"increment_error", "a signal of the incremental track is bad",
     "stop the servo system at once; then `absenc clear-alarms`"},
}};

/// Values of the fields of a frame, or of a procedure's result.
struct Values {
  std::optional<std::uint8_t> encoder_address{};  ///< Address of the encoder (EA).
  std::optional<std::uint8_t> command{};          ///< Command code (CC) of the request.
  std::optional<std::uint8_t> status{};           ///< Status bits of the reply (ES).
  std::optional<std::uint32_t> singleturn{};      ///< Position within the turn, in counts (ABS).
  /// Lower 17 bits of the position, from an encoder whose position has more bits.
  std::optional<std::uint32_t> low_bits{};
  std::optional<std::uint32_t> multiturn{};  ///< Number of turns (ABM).
  std::optional<std::uint16_t> alarms{};     ///< Alarms (ALM), described by `alarm_flags`.
  std::optional<double> temperature{};       ///< Temperature of the encoder, in degC.
  std::optional<std::uint8_t> address{};     ///< Address of a word of the EEPROM.
  std::optional<std::uint16_t> value{};      ///< Value of a word of the EEPROM.
  std::optional<Bytes> data{};               ///< Words of the EEPROM from `address` on, the low byte of each first.
  std::optional<std::uint32_t> identification{};  ///< Identification code of the encoder, 24 bits.
  /// True if the word, identification or address was written; false if the encoder had it already.
  std::optional<bool> written{};
  std::optional<bool> clash{};  ///< Scan: true if no reply of the address was valid and at least one was damaged.
};

/// Table of the fields in which requests, replies and results of procedures are reported.
inline constexpr auto fields = [] {
  using author::field;
  using author::in_hex;
  return author::fields_of<Values>(
      field<&Values::encoder_address>("encoder_address", "", "address of the encoder on its line (EA)", Role::encoder),
      field<&Values::command>("command", "", "command code (CC)", Role::exchange),
      in_hex(field<&Values::status>("encoder_status", "", "status bits of the reply (ES), not 0 with an alarm")),
      field<&Values::singleturn>("singleturn", "counts", "position within the turn (ABS)", Role::position),
      field<&Values::low_bits>("low_bits", "counts", "lower 17 bits of a position within the turn that has more"),
      field<&Values::multiturn>("multiturn", "revolutions", "turns (ABM)", Role::turns),
      field<&Values::alarms>("alarms", "alarms (ALM)", alarm_flags),
      field<&Values::temperature>("temperature_c", "degC", "of the encoder, in steps of 0.25"),
      field<&Values::address>("address", "", "address of the word in the EEPROM"),
      field<&Values::value>("value", "", "the word in the EEPROM", Role::value),
      field<&Values::data>("data", "", "the words in the EEPROM from `address` on, the low byte first", Role::data),
      in_hex(
          field<&Values::identification>("identification", "", "identification code of the encoder", Role::identity)),
      field<&Values::written>("written", "", "false when the value was there already", Role::written),
      field<&Values::clash>("clash", "", "the reply was damaged: two encoders of one address, or a bad line",
                            Role::clash));
}();

/// Returns the values of the fields of a request.
[[nodiscard]] constexpr Values values_of(const Request& request) {
  Values all{.encoder_address = request.address, .command = static_cast<std::uint8_t>(request.code)};
  if (is_memory_access(request.code)) all.address = request.word;
  if (request.code == Code::write_memory) all.value = static_cast<std::uint16_t>(request.value);
  if (sends_identity(request.code)) all.identification = request.value;
  return all;
}

/// Converts a temperature, 10 bits in quarters of a degree, to degC.
[[nodiscard]] constexpr double degrees_of(std::uint64_t quarters) { return static_cast<double>(quarters & 0x3FF) / 4; }

/// Returns the values of the fields of one encoder's reply to a request with the command code `code`.
[[nodiscard]] constexpr Values values_of(const Format& format, Code code, const OneReply& reply) {
  Values all{.encoder_address = reply.address, .command = static_cast<std::uint8_t>(code), .status = reply.status};
  if (const auto counts = singleturn_in(format, code, reply.data)) {
    all.singleturn = static_cast<std::uint32_t>(*counts);
  }
  if (const auto turns = multiturn_in(format, code, reply.data)) all.multiturn = static_cast<std::uint32_t>(*turns);
  all.alarms = alarms_in(code, reply.data);
  const Code one = single(code);
  if (one == Code::short_position && !all.singleturn) all.low_bits = static_cast<std::uint32_t>(reply.data);
  if (one == Code::temperature) all.temperature = degrees_of(reply.data);
  if (one == Code::with_temperature) all.temperature = degrees_of(reply.data >> 24);
  const std::uint32_t stored = in_bit_order(format, code, static_cast<std::uint32_t>(reply.data));
  if (is_memory_access(one)) {
    all.value = static_cast<std::uint16_t>(stored);
    all.address = static_cast<std::uint8_t>(reply.data >> 16);
  }
  if (has_identity(one)) all.identification = stored;
  return all;
}

/// Returns the bits of one encoder's valid reply that carry `field`; no bits if the reply does not carry it.
[[nodiscard]] constexpr BitRanges place_of(const Format& format, Code code, const FieldInfo& field) {
  using author::bits_of;
  const Code one = single(code);
  const bool is_short = one == Code::short_position;
  const bool is_low_first = format.bit_order == BitOrder::low_first;
  if (&field == fields.of<&Values::encoder_address>()) return bits_of(0, 3, 3);
  if (&field == fields.of<&Values::command>()) return bits_of(0, 6, is_short ? 0 : 5);
  if (&field == fields.of<&Values::status>()) return is_short ? bits_of(0, 6, 1) : bits_of(1, 4, 4);
  if (&field == fields.of<&Values::low_bits>()) return bits_of(0, 7, short_bits);
  if (&field == fields.of<&Values::singleturn>()) {
    return is_short ? bits_of(0, 7, short_bits) : bits_of(2, 0, format.singleturn_bits);
  }
  if (&field == fields.of<&Values::multiturn>()) {
    return bits_of(2, one == Code::position ? format.singleturn_bits : format.singleturn_bits - 16,
                   format.multiturn_bits);
  }
  if (&field == fields.of<&Values::alarms>()) return bits_of(one == Code::with_alarms ? 5 : 2, 0, alarm_flags.size());
  if (&field == fields.of<&Values::address>()) return bits_of(4, 0, 8);
  if (&field == fields.of<&Values::value>()) return bits_of(2, 0, is_low_first ? 16 : 0);
  if (&field == fields.of<&Values::identification>()) return bits_of(2, 0, is_low_first ? 24 : 0);
  return {};
}

}  // namespace absenc::nikon
