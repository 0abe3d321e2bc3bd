// SPDX-License-Identifier: Apache-2.0
// Constants of SICK's HIPERFACE parameter channel (commands, status codes, types, times), and Format, the properties in
// which encoders differ. README.md has the source of each value.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/unit.hpp"

/// SICK HIPERFACE, the parameter channel.
namespace absenc::hiperface {

using namespace std::chrono_literals;

/// Baud rates of the line in bits per second. The index of a rate is its code in the interface setting.
inline constexpr std::array<std::uint32_t, 7> rates{600, 1'200, 2'400, 4'800, 9'600, 19'200, 38'400};
inline constexpr std::uint8_t rate_at_shipping = 4;  ///< Index in `rates` of the baud rate at shipping.
/// Mask of the bits of the interface setting that are the code of the baud rate.
inline constexpr std::uint8_t rate_bits = 0x07;
/// Interface setting at shipping (Mode_485): 9600 baud, parity even.
inline constexpr std::uint8_t interface_at_shipping = 0xE4;

inline constexpr std::uint8_t first_address = 0x40;      ///< Lowest address of an encoder, which it has at shipping.
inline constexpr std::uint8_t last_address = 0x5F;       ///< Highest address of an encoder.
inline constexpr std::uint8_t broadcast_address = 0xFF;  ///< Address that every encoder answers.
/// Value of each access code at shipping; the code that protects settings is access code 0.
inline constexpr std::uint8_t code_at_shipping = 0x55;
/// Error bit in the command byte of a reply: an alarm is raised, which the status names.
inline constexpr std::uint8_t error_bit = 0x80;

// ---- Times, of drivers or assumed (README.md)

inline constexpr Time answer_time = 5ms;  ///< Time from a request to the reply of the virtual encoder.
/// Additional time of the virtual encoder until its reply to a request that stores something.
inline constexpr Time store_time = 20ms;
inline constexpr Time request_pause = 6ms;  ///< Shortest time from a reply to the host's next request.
/// Longest time that a host waits for the reply to a request that reads; `reply_characters` is added to it.
inline constexpr Time read_limit = 50ms;
/// Longest time that a host waits for the reply to a request that stores something; `reply_characters` is added to it.
inline constexpr Time store_limit = 250ms;
/// Longest pause inside a frame, in durations of a character; a host adds the same time to its timeouts `read_limit`
/// and `store_limit`.
inline constexpr int reply_characters = 5;
inline constexpr Time create_time = 200ms;  ///< Time that a host waits after it has created a data field.
inline constexpr Time start_time = 250ms;   ///< Time from power on or a reset until the virtual encoder answers.
/// Longest time for which a host waits, between its requests after a reset, for the encoder to answer again.
inline constexpr Time start_limit = 2s;

/// Code of a command: the second byte of requests and replies.
enum class CommandCode : std::uint8_t {
  position = 0x42,
  set_position = 0x43,
  analog_value = 0x44,
  counter = 0x46,
  count_up = 0x47,
  clear_counter = 0x49,
  read_data = 0x4A,
  store_data = 0x4B,
  field_status = 0x4C,
  create_field = 0x4D,
  free_memory = 0x4E,
  access_code = 0x4F,
  status = 0x50,
  type_label = 0x52,
  reset = 0x53,
  set_address = 0x55,
  serial_number = 0x56,
  interface = 0x57,
};

/// Channel of the command 44 (read analog value) that carries the temperature of the encoder in degC.
inline constexpr std::uint8_t temperature_channel = 0x48;

// ---- Data fields

inline constexpr std::size_t field_capacity = 128;  ///< Greatest size of a data field in bytes.
/// Size in bytes of a memory block; sizes of data fields and of the memory are multiples of it.
inline constexpr std::size_t block_size = 16;
/// Number of data fields that hosts can access. They have the numbers 0 to 13; the description is not one of them.
inline constexpr std::uint8_t user_fields = 14;
/// Number of the data field with the description: the resolution and the range of the encoder.
inline constexpr std::uint8_t description_field = 0xFF;
inline constexpr std::size_t description_size = 10;  ///< Number of bytes of the description that drivers read.
/// Type in the type label of encoders whose resolution only the description shows.
inline constexpr std::uint8_t type_in_description = 0xFF;
/// Size of the memory in the type label of the virtual encoder, in blocks of 16 bytes.
inline constexpr std::uint8_t memory_blocks = 0x80;
/// Greatest number of bytes that a host reads from a data field with one request.
inline constexpr std::size_t read_at_once = 32;

/// Bits of the status of a data field.
namespace field_status {
inline constexpr std::uint8_t exists = 0x80;       ///< Status bit: the data field exists.
inline constexpr std::uint8_t writable = 0x40;     ///< Status bit: the data field can be written.
inline constexpr std::uint8_t code_number = 0x30;  ///< Mask of the number of the data field's access code, 0 to 3.
/// Status bit: the data field cannot be accessed without its access code.
inline constexpr std::uint8_t needs_code = 0x08;
inline constexpr std::uint8_t size = 0x07;  ///< Mask of the data field's size: number of blocks of 16 bytes, minus one.
}  // namespace field_status

/// Returns the size in bytes of a data field with this status; 0 if it does not exist.
[[nodiscard]] constexpr std::size_t field_size(std::uint8_t status) {
  return (status & field_status::exists) == 0 ? 0 : block_size * ((status & field_status::size) + 1u);
}

/// Areas of the memory that hosts can access; a page is a data field.
inline constexpr std::array<MemoryArea, 3> memory_areas{{
    {0, 0, field_capacity, "data field 0; it may be smaller"},
    {.page = 1,
     .first = 0,
     .count = field_capacity,
     .meaning = "data field, if the encoder has it; it may be smaller",
     .in_dump = false,
     .pages = user_fields - 1},
    {description_field, 0, description_size, "description of the encoder: resolution and range", false, false},
}};

// ---- Status codes

/// An alarm of the encoder: a status code that describes its state, not a refused request.
struct Alarm {
  std::uint8_t code;         ///< Status code that reports the alarm.
  std::string_view name;     ///< Name of the alarm.
  std::string_view meaning;  ///< Description of the alarm's cause, as a phrase.
  std::string_view action;   ///< Advice to the operator.
};

namespace detail {
inline constexpr std::string_view restart = "`absenc run ... reset`; if it stays, replace the encoder";
inline constexpr std::string_view check_turns =
    "`absenc run ... reset`, then compare the turns with a known position; if it stays, replace the encoder";
}  // namespace detail

/// All alarms. The index of an alarm is its bit number in the alarms of a reading.
inline constexpr auto alarms = std::array{
    Alarm{0x01, "analog_signals", "sine and cosine are outside their limits, or the compensation data is wrong",
          detail::restart},
    Alarm{0x02, "angular_offset", "the internal angular offset is wrong", detail::restart},
    Alarm{0x03, "field_table", "the table of the data fields is damaged", detail::restart},
    Alarm{0x04, "analog_limits", "the limits of the analog signals are not available", detail::restart},
    Alarm{0x05, "internal_bus", "the internal I2C bus does not work", detail::restart},
    Alarm{0x06, "internal_checksum", "an internal checksum is wrong", detail::restart},
    Alarm{0x07, "watchdog_reset", "the encoder was reset by its program monitoring",
          "read again; if it stays, replace the encoder"},
    Alarm{0x08, "counter_overflow", "the counter has overflowed", "`absenc run ... clear-counter`"},
    Alarm{0x1C, "signal_amplitude", "the amplitude of sine and cosine is outside its limits",
          "look for dirt, heat and a mounting that is out of tolerance"},
    Alarm{0x1D, "led_current", "the current of the LED is critical: dirt, or the LED ages",
          "plan to replace the encoder"},
    Alarm{0x1E, "temperature", "the temperature of the encoder is critical", "cool it, then read again"},
    Alarm{0x1F, "over_speed", "the shaft turns too fast to form a position", "turn it more slowly, then read again"},
    Alarm{0x20, "singleturn_position", "the position within the turn is not reliable", detail::restart},
    Alarm{0x21, "multiturn_position_1", "the turns are wrong (code 21)", detail::check_turns},
    Alarm{0x22, "multiturn_position_2", "the turns are wrong (code 22)", detail::check_turns},
    Alarm{0x23, "multiturn_position_3", "the turns are wrong (code 23)", detail::check_turns},
};

/// Mask of all alarms in the alarms of a reading.
inline constexpr std::uint32_t all_alarms = (1u << alarms.size()) - 1;

/// Status codes of the alarms without their texts, which firmware does not need.
inline constexpr auto alarm_codes = [] {
  std::array<std::uint8_t, alarms.size()> codes{};
  for (std::size_t i = 0; i < codes.size(); ++i) codes[i] = alarms[i].code;
  return codes;
}();

/// Returns the mask of the alarm with this status code; 0 if the code is no alarm.
[[nodiscard]] constexpr std::uint32_t alarm_of(std::uint8_t code) {
  for (std::size_t i = 0; i < alarm_codes.size(); ++i) {
    if (alarm_codes[i] == code) return 1u << i;
  }
  return 0;
}
/// Mask of the alarms that are warnings: position and turns stay valid.
inline constexpr std::uint32_t warnings =
    alarm_of(0x03) | alarm_of(0x05) | alarm_of(0x07) | alarm_of(0x08) | alarm_of(0x1D) | alarm_of(0x1E);
/// Mask of the alarms that make the turns alone invalid.
inline constexpr std::uint32_t turns_lost = alarm_of(0x21) | alarm_of(0x22) | alarm_of(0x23);

/// Status codes with which an encoder refuses a request.
namespace refusal {
inline constexpr std::uint8_t parity = 0x09;         ///< Refusal: a character of the request had a wrong parity.
inline constexpr std::uint8_t checksum = 0x0A;       ///< Refusal: the checksum of the request is wrong.
inline constexpr std::uint8_t command = 0x0B;        ///< Refusal: the encoder does not have this command.
inline constexpr std::uint8_t length = 0x0C;         ///< Refusal: the number of bytes of the request is wrong.
inline constexpr std::uint8_t argument = 0x0D;       ///< Refusal: a value of the request is not permitted.
inline constexpr std::uint8_t not_writable = 0x0E;   ///< Refusal: the data field must not be written.
inline constexpr std::uint8_t access_code = 0x0F;    ///< Refusal: the access code is wrong.
inline constexpr std::uint8_t size_is_fixed = 0x10;  ///< Refusal: the size of the data field cannot be changed.
inline constexpr std::uint8_t outside = 0x11;        ///< Refusal: the address is outside the data field.
inline constexpr std::uint8_t no_field = 0x12;       ///< Refusal: the data field does not exist.

/// Texts for the status codes from `parity` to `no_field`, in the order of the codes.
inline constexpr auto texts = std::array<std::string_view, 10>{
    "09: it received a character with a wrong parity",
    "0A: it received the request with a wrong checksum",
    "0B: it does not have this command",
    "0C: the request has a wrong number of bytes for it",
    "0D: a value of the request is not permitted",
    "0E: the data field must not be written",
    "0F: the access code is wrong (options code0 and access_code)",
    "10: the size of this data field cannot be changed",
    "11: the address is outside the data field",
    "12: the data field does not exist",
};
}  // namespace refusal

/// Returns whether no source explains a status code: it is not 0, is no alarm, and is no refusal.
[[nodiscard]] constexpr bool is_unexplained(std::uint8_t code) {
  return code != 0 && alarm_of(code) == 0 && (code < refusal::parity || code > refusal::no_field);
}

/// Returns the meaning of a status code in words.
[[nodiscard]] constexpr std::string_view text_of_status(std::uint8_t code) {
  if (code == 0) return "no error";
  if (code >= refusal::parity && code <= refusal::no_field) return refusal::texts[code - refusal::parity];
  for (const Alarm& alarm : alarms) {
    if (alarm.code == code) return alarm.meaning;
  }
  return "a code that no source explains";
}

// ---- Types

/// A type of encoder as the type label states it; encoders of one or more families have it.
struct Type {
  std::uint8_t id;        ///< Number of the type in the type label.
  std::string_view name;  ///< Names of the encoder families of this type.
  /// Numbers of bits of position and turns; 0 and 0: the type label does not show them for this type.
  Resolution resolution{};
};
/// Table of all types whose names drivers know.
inline constexpr auto types = std::array{
    Type{0x02, "SHS, SCS", {14, 0}},
    Type{0x07, "SCM", {14, 12}},
    Type{0x22, "SRS, SCK, SFS60", {15, 0}},
    Type{0x27, "SRM, SCL, SFM60", {15, 12}},
    Type{0x32, "SKS", {12, 0}},
    Type{0x37, "SKM", {12, 12}},
    Type{0x42, "SEK", {9, 0}},
    Type{0x47, "SEL", {9, 12}},
    Type{0x82, "LinCoder"},
    Type{0x90, "DME, 1 mm"},
    Type{0x91, "DME, 2 mm"},
    Type{0x92, "DME, 4 mm"},
    Type{0x93, "DME, 8 mm"},
    Type{0x94, "DME, 16 mm"},
    Type{type_in_description, "described by data field FF"},
};
/// Returns the names of the families of a type; "unknown" if no driver knows it.
[[nodiscard]] constexpr std::string_view name_of_type(std::uint8_t id) {
  for (const Type& type : types) {
    if (type.id == id) return type.name;
  }
  return "unknown";
}

/// Types with their numbers of bits, without their names, which firmware does not need.
inline constexpr auto type_resolutions = [] {
  std::array<std::pair<std::uint8_t, Resolution>, types.size()> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = {types[i].id, types[i].resolution};
  return all;
}();

/// Returns the numbers of position and turn bits of a type; 0 and 0 if the type does not show them.
[[nodiscard]] constexpr Resolution resolution_of_type(std::uint8_t id) {
  for (const auto& [type, resolution] : type_resolutions) {
    if (type == id) return resolution;
  }
  return {};
}

/// Returns the number of the type that has these numbers of bits. If there is none, returns the number of the type
/// whose resolution is described in data field FF.
[[nodiscard]] constexpr std::uint8_t type_with(const Resolution& bits) {
  for (const Type& type : types) {
    if (type.resolution.singleturn_bits == bits.singleturn_bits &&
        type.resolution.multiturn_bits == bits.multiturn_bits) {
      return type.id;
    }
  }
  return type_in_description;
}

/// Least number of bits of the position in a turn: the 5 bits of one sine period.
inline constexpr std::uint8_t least_singleturn_bits = 5;
inline constexpr std::uint8_t most_singleturn_bits = 20;  ///< Greatest number of bits of the position in a turn.
inline constexpr std::uint8_t most_multiturn_bits = 12;   ///< Greatest number of bits of the turns.
/// Resolution that is assumed if neither options nor type show it: that of an SKM.
inline constexpr Resolution assumed_resolution{12, 12};

/// Properties of an encoder that its frames depend on, and its access codes. The members are the options of the unit.
struct Format {
  /// Number of bits of the position within the turn, 5 to 20; 0: the host reads it from the type label.
  std::uint8_t singleturn_bits = 0;
  /// Number of bits of the turns, 0 to 12; 0: single-turn encoder; -1: the host reads it from the type label.
  std::int8_t multiturn_bits = -1;
  std::uint8_t address = first_address;         ///< Address of the encoder, 40 to 5F (hex).
  std::uint8_t code0 = code_at_shipping;        ///< Access code 0, which protects position and settings.
  std::uint8_t access_code = code_at_shipping;  ///< Access code to read, write and create data fields.
  std::uint8_t rate = rate_at_shipping;         ///< Index of the line's baud rate in `rates`.
  /// Type of the encoder in the type label; 0: not stated, the virtual encoder then has a type with its resolution.
  std::uint8_t type = 0;
  std::uint8_t status_bytes = 1;   ///< Number of bytes of the status code in a status reply or a refusal, 1 or 2.
  std::uint8_t counter_bytes = 3;  ///< Number of bytes of the counter in a reply, 1 to 4.
  /// Number of bytes of the free memory in a reply. 1: it is in blocks of 16 bytes; 2: it is in bytes.
  std::uint8_t free_bytes = 1;
  std::uint8_t serial_bytes = 9;    ///< Number of characters of the serial number.
  std::uint8_t version_bytes = 28;  ///< Number of characters of the program version with its date.

  /// Returns the settings of the RS-485 line.
  [[nodiscard]] constexpr LineSettings line() const { return {.rate = rates[rate], .parity = Parity::even}; }
  /// Returns whether the options state the numbers of bits of position and turns.
  [[nodiscard]] constexpr bool is_known() const { return singleturn_bits != 0 && multiturn_bits >= 0; }
  /// Returns the numbers of bits of position and turns. If the options do not state them, those of `type` are used, or
  /// assumed ones.
  [[nodiscard]] constexpr Resolution resolution() const {
    Resolution bits = resolution_of_type(type);
    if (bits.singleturn_bits == 0) bits = assumed_resolution;
    if (singleturn_bits != 0) bits.singleturn_bits = singleturn_bits;
    if (multiturn_bits >= 0) bits.multiturn_bits = static_cast<unsigned>(multiturn_bits);
    return bits;
  }
  /// Returns the number of bits of position and turns together.
  [[nodiscard]] constexpr unsigned position_bits() const {
    const Resolution bits = resolution();
    return bits.singleturn_bits + bits.multiturn_bits;
  }
  /// Returns the type that the virtual encoder has in its type label.
  [[nodiscard]] constexpr std::uint8_t type_in_label() const { return type != 0 ? type : type_with(resolution()); }
  /// Returns whether `bits`, the resolution that an encoder reports, contradicts the options. If the encoder reports
  /// none, which is 0 and 0, nothing is contradicted.
  [[nodiscard]] constexpr bool contradicts(const Resolution& bits) const {
    const bool is_other_turn = singleturn_bits != 0 && singleturn_bits != bits.singleturn_bits;
    const bool are_other_turns = multiturn_bits >= 0 && static_cast<unsigned>(multiturn_bits) != bits.multiturn_bits;
    return bits.singleturn_bits != 0 && (is_other_turn || are_other_turns);
  }
  /// Returns a copy of this format with the resolution `bits`.
  [[nodiscard]] constexpr Format with(const Resolution& bits) const {
    Format known = *this;
    known.singleturn_bits = static_cast<std::uint8_t>(bits.singleturn_bits);
    known.multiturn_bits = static_cast<std::int8_t>(bits.multiturn_bits);
    return known;
  }
};

}  // namespace absenc::hiperface
