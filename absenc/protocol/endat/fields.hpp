// SPDX-License-Identifier: Apache-2.0
// Names, units and meanings of the values in EnDat frames and results.
#pragma once

#include <array>
#include <optional>

#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/endat/protocol.hpp"

namespace absenc::endat {

/// Descriptions of the alarms: the error messages (word 0 of the operating status) from bit 0 on, the warnings (word 1)
/// from bit 8 on, then the group bits of the position.
inline constexpr std::array<FlagInfo, 16> alarm_flags{{
    {"light_source", "the light source has failed", "replace the encoder if `absenc clear-alarms` does not help"},
    {"signal_amplitude", "the scanning signals are too small or too large",
     "check mounting, gap and dirt, then `absenc clear-alarms`"},
    {"position_value", "the position was calculated wrongly",
     "stop the drive; check mounting and shielding, then `absenc clear-alarms`"},
    {"overvoltage", "the supply voltage is too high", "measure the supply at the encoder, then `absenc clear-alarms`"},
    {"undervoltage", "the supply voltage is too low",
     "measure the supply at the encoder, connect the sense lines, then `absenc clear-alarms`"},
    {"overcurrent", "the encoder draws too much current", "check cable and connector, then `absenc clear-alarms`"},
    {"battery", "the battery was empty: the turns are lost",
     "replace the battery, return to the origin, then `absenc clear-alarms`"},
    {},
    {"frequency", "the shaft turned faster than the encoder can measure", "turn more slowly, then clear the alarms"},
    {"temperature", "the encoder is or was too hot", "let it cool, then clear the alarms"},
    {"light_reserve", "the light source is near its limit", "clean or replace the encoder soon"},
    {"battery_charge", "the battery's charge is low",
     "replace the battery with the encoder switched on, then clear the alarms"},
    {"reference_point", "the reference point has not been passed", "pass the reference mark"},
    {},
    {"error", "F1 or F2 says that the position is wrong", "`absenc run ... status`, then `absenc clear-alarms`"},
    {"warning", "WRN says that a warning is set", "`absenc run ... status` names it", true},
}};

/// Values of the fields of a frame, or of a procedure's result.
struct Values {
  std::optional<std::uint8_t> command{};       ///< Mode command of the request.
  std::optional<std::uint8_t> area{};          ///< MRS code of a memory area or of an additional information.
  std::optional<std::uint8_t> address{};       ///< Address of a word in its area.
  std::optional<std::uint16_t> value{};        ///< Content of a word.
  std::optional<Bytes> data{};                 ///< Words from `address` on, the low byte of each first.
  std::optional<std::uint8_t> port{};          ///< Port of a test command, or encoder of a communication command.
  std::optional<std::uint16_t> instruction{};  ///< 16 bits of a test or communication command.
  std::optional<std::uint64_t> multiturn{};    ///< Number of turns.
  std::optional<std::uint64_t> singleturn{};   ///< Position within the turn, in counts.
  std::optional<std::uint64_t> position{};     ///< Position of a linear encoder, in counts.
  std::optional<double> position_um{};         ///< Position of a linear encoder, in micrometres.
  std::optional<bool> f1{};                    ///< Error bit F1 as sent.
  std::optional<bool> f2{};                    ///< Error bit F2 as sent.
  std::optional<std::uint16_t> start{};        ///< Clocks before the start bit.
  std::optional<bool> warning{};               ///< Group bit of the warnings.
  std::optional<bool> referenced{};            ///< Whether the reference mark was passed.
  std::optional<bool> busy{};                  ///< Whether an access to the memory is in progress.
  std::optional<std::uint8_t> info1_code{};    ///< MRS code of additional information 1.
  std::optional<std::uint16_t> info1{};        ///< Content of additional information 1.
  std::optional<std::uint8_t> info2_code{};    ///< MRS code of additional information 2.
  std::optional<std::uint16_t> info2{};        ///< Content of additional information 2.
  std::optional<std::uint64_t> test_values{};  ///< 40 bits of test values.
  std::optional<std::uint16_t> alarms{};       ///< Alarms, described by `alarm_flags`.
  std::optional<double> temperature{};         ///< Temperature of the encoder, in degC.
  std::optional<std::uint16_t> type{};         ///< Type of the encoder, as word 14 has it.
  std::optional<std::string_view> kind{};      ///< Type of the encoder in words.
  std::optional<Bytes> id{};                   ///< ID number, words 24 to 26, the low byte of each first.
  std::optional<Bytes> serial{};               ///< Serial number, words 27 to 29, the low byte of each first.
  std::optional<std::uint8_t> bits{};          ///< Bits of the position, turns included.
  std::optional<std::uint32_t> periods{};      ///< Signal periods of a turn, or the length of one in nm.
  std::optional<std::uint16_t> revolutions{};  ///< Distinguishable revolutions.
  std::optional<std::uint32_t> steps{};        ///< Measuring steps of a turn, or the length of one in nm.
  std::optional<bool> speaks_22{};             ///< Whether the encoder has the commands of EnDat 2.2.
  std::optional<std::uint8_t> recovery{};      ///< Recovery time: 0 long, 1 short.
  std::optional<std::uint32_t> line_delay{};   ///< Delay of the line, there and back, in ns.
  std::optional<bool> delay_shorter{};        ///< Whether the delay is shorter than `line_delay`: too short to measure.
  std::optional<std::int32_t> datum_shift{};  ///< Datum shift, in signal periods.
  std::optional<bool> written{};              ///< False if the encoder had the value already.
};

/// Table of the fields of requests, replies and results.
inline constexpr auto fields = [] {
  using author::field;
  using author::in_hex;
  return author::fields_of<Values>(
      in_hex(field<&Values::command>("command", "", "mode command", Role::exchange)),
      in_hex(field<&Values::area>("area", "", "MRS code: memory area or additional information")),
      field<&Values::address>("address", "", "address of the word in its area"),
      in_hex(field<&Values::value>("value", "", "content of the word", Role::value)),
      field<&Values::data>("data", "", "words from `address` on, the low byte of each first", Role::data),
      field<&Values::port>("port", "", "port of a test command, or encoder of a communication command"),
      in_hex(field<&Values::instruction>("instruction", "", "16 bits of a test or communication command")),
      field<&Values::multiturn>("multiturn", "revolutions", "turns", Role::turns),
      field<&Values::singleturn>("singleturn", "counts", "position within the turn", Role::position),
      field<&Values::position>("position", "counts", "position of a linear encoder", Role::position),
      field<&Values::position_um>("position_um", "um", "position of a linear encoder", Role::of_position),
      field<&Values::f1>("f1", "", "error bit F1: 1 means an error"),
      field<&Values::f2>("f2", "", "error bit F2: 0 means an error"),
      field<&Values::start>("start_clocks", "", "clocks from the first one to the start bit", Role::exchange),
      field<&Values::warning>("warning", "", "WRN: a warning is set"),
      field<&Values::referenced>("referenced", "", "RM: the reference mark was passed"),
      field<&Values::busy>("busy", "", "an access to the memory is in progress"),
      in_hex(field<&Values::info1_code>("info1_code", "", "MRS code of additional information 1")),
      in_hex(field<&Values::info1>("info1", "", "content of additional information 1")),
      in_hex(field<&Values::info2_code>("info2_code", "", "MRS code of additional information 2")),
      in_hex(field<&Values::info2>("info2", "", "content of additional information 2")),
      in_hex(field<&Values::test_values>("test_values", "", "40 bits of test values")),
      field<&Values::alarms>("alarms", "error messages, warnings, and their group bits", alarm_flags),
      field<&Values::temperature>("temperature_c", "degC", "temperature inside the encoder"),
      in_hex(field<&Values::type>("type", "", "type of the encoder, word 14")),
      field<&Values::kind>("kind", "", "type of the encoder in words", Role::identity),
      field<&Values::id>("id_number", "", "ID number, words 24 to 26, the low byte of each first", Role::identity),
      field<&Values::serial>("serial_number", "", "serial number, words 27 to 29, the low byte of each first",
                             Role::identity),
      field<&Values::bits>("position_bits", "", "bits of the position, turns included"),
      field<&Values::periods>("signal_periods", "", "signal periods of a turn; linear: length of one, in nm"),
      field<&Values::revolutions>("revolutions", "", "distinguishable revolutions; 0: none"),
      field<&Values::steps>("measuring_steps", "", "measuring steps of a turn; linear: length of one, in nm"),
      field<&Values::speaks_22>("endat_22", "", "whether the encoder has the commands of EnDat 2.2"),
      field<&Values::recovery>("recovery", "", "recovery time: 0 is 10 to 30 us, 1 is 1.25 to 3.75 us"),
      field<&Values::line_delay>("line_delay_ns", "ns", "delay of line and transceivers, there and back"),
      field<&Values::delay_shorter>("delay_shorter", "",
                                    "whether the delay is shorter than that, too short to measure"),
      field<&Values::datum_shift>("datum_shift", "", "datum shift, in signal periods"),
      field<&Values::written>("written", "", "false when the value was there already", Role::written));
}();

/// Returns the values of the fields of a request.
[[nodiscard]] constexpr Values values_of(const Request& request) {
  Values all{.command = static_cast<std::uint8_t>(request.code)};
  switch (request.code) {
    case ModeCommand::select:
    case ModeCommand::select_22:
      all.area = request.byte;
      break;
    case ModeCommand::read:
    case ModeCommand::read_22:
      all.address = request.byte;
      break;
    case ModeCommand::write:
    case ModeCommand::write_22:
      all.address = request.byte;
      all.value = request.word;
      break;
    case ModeCommand::test:
    case ModeCommand::test_22:
    case ModeCommand::communicate:
      all.port = request.byte;
      all.instruction = request.word;
      break;
    default:
      break;
  }
  return all;
}

/// Puts the values of a position into `all`.
constexpr void add_position(Values& all, const Format& given, const Reply& reply) {
  const Format format = with_resolution(given);
  const Resolution resolution = format.resolution();
  const std::uint64_t counts = reply.position & low_mask(resolution.singleturn_bits);
  if (format.is_linear()) {
    all.position = counts;
    if (resolution.unit_um > 0) all.position_um = micrometres(counts, resolution.unit_um);
    return;
  }
  all.singleturn = counts;
  if (resolution.multiturn_bits != 0) all.multiturn = reply.position >> resolution.singleturn_bits;
}

/// Returns the values of the fields of a valid reply.
[[nodiscard]] constexpr Values values_of(const Format& format, const Request& request, const Reply& reply) {
  Values all = values_of(request);
  if (!request.with_alarms) all.start = reply.start;
  if (request.code == ModeCommand::test_values) {
    all.f1 = reply.f1;
    all.test_values = reply.position;
  } else if (has_position(request.code)) {
    add_position(all, format, reply);
    all.f1 = reply.f1;
    if (is_22(request.code)) all.f2 = reply.f2;
  } else if (request.code == ModeCommand::read) {
    all.value = reply.word;
  } else if (request.code == ModeCommand::test || request.code == ModeCommand::communicate) {
    all.instruction = reply.word;
  }
  if (reply.alarm_words) all.alarms = static_cast<std::uint16_t>(reading_of(format, request.code, reply).alarms);
  if (const Info* const info = reply.info(1)) {
    all.warning = info->warning;
    all.referenced = info->referenced;
    all.busy = info->busy;
    all.info1_code = static_cast<std::uint8_t>(0x40 | info->number);
    all.info1 = info->content;
  }
  if (const Info* const info = reply.info(2)) {
    all.warning = info->warning;
    all.busy = info->busy;
    all.info2_code = static_cast<std::uint8_t>(0x40 | info->number);
    all.info2 = info->content;
  }
  return all;
}

}  // namespace absenc::endat
