// SPDX-License-Identifier: Apache-2.0
// Names and values of the fields of HIPERFACE requests, replies and results, and their places in a reply.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/protocol/author/bits.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/hiperface/frame.hpp"

namespace absenc::hiperface {

/// The one status flag of a reply: the error bit, bit 7 of its command byte.
inline constexpr std::array<FlagInfo, 1> status_flags{
    {{"error", "the encoder has an error or a warning", read_the_alarms, false, all_alarms}}};
/// Descriptions of the alarms, in the order of the table `alarms` in format.hpp.
inline constexpr auto alarm_flags = [] {
  std::array<FlagInfo, alarms.size()> flags{};
  for (std::size_t i = 0; i < flags.size(); ++i) {
    flags[i] = {alarms[i].name, alarms[i].meaning, alarms[i].action};
  }
  return flags;
}();

/// Values of the fields of a frame, or of a procedure's result. A member without a value is not in the frame.
struct Values {
  std::optional<std::uint8_t> encoder_address{};  ///< Address of the encoder.
  std::optional<std::string_view> command{};      ///< Name of the request's command.
  std::optional<std::uint32_t> singleturn{};      ///< Position within the turn, in counts.
  std::optional<std::uint32_t> multiturn{};       ///< Number of turns.
  std::optional<std::uint8_t> status{};           ///< Status of the reply, described by `status_flags`.
  std::optional<std::uint32_t> alarms{};          ///< Alarms, described by `alarm_flags`.
  /// Status code that the encoder reports: an alarm, the reason of a refusal, or 0.
  std::optional<std::uint8_t> status_code{};
  std::optional<std::string_view> status_text{};  ///< Meaning of the status code in words.
  std::optional<std::uint32_t> position{};        ///< Position that a request sets; it contains the turns.
  std::optional<std::uint8_t> channel{};          ///< Channel of an analog value that is read.
  std::optional<std::int16_t> analog_value{};     ///< Analog value as the encoder sends it.
  std::optional<std::int16_t> temperature{};      ///< Temperature of the encoder, in degC.
  std::optional<std::uint32_t> counter{};  ///< Value of the encoder's counter, which a host can increment and clear.
  std::optional<std::uint8_t> field{};     ///< Number of the data field that a request accesses.
  std::optional<std::uint8_t> address{};   ///< Address of a byte in the data field.
  std::optional<std::uint8_t> count{};     ///< Number of bytes that a request reads or stores.
  std::optional<std::uint8_t> value{};     ///< The byte at `address` of the data field.
  std::optional<Bytes> data{};             ///< Bytes of the data field from `address` on.
  std::optional<bool> exists{};            ///< Whether the data field exists.
  std::optional<bool> writable{};          ///< Whether the data field can be written.
  std::optional<bool> needs_code{};        ///< Whether the data field needs its access code.
  std::optional<std::uint8_t> number{};    ///< Number of an access code, 0 to 3.
  std::optional<std::uint16_t> size{};     ///< Size of the data field in bytes.
  std::optional<std::uint32_t> free_memory{};  ///< Number of bytes for which data fields can still be created.
  /// Interface setting (Mode_485): baud rate, parity and timeout of the encoder.
  std::optional<std::uint8_t> interface_setting{};
  std::optional<std::uint32_t> baud{};          ///< Baud rate of the interface setting, in bits per second.
  std::optional<std::uint8_t> type{};           ///< Type of the encoder, from the type label.
  std::optional<std::string_view> type_name{};  ///< Names of the encoder families that have this type.
  std::optional<std::uint32_t> memory_size{};   ///< Size of the encoder's memory in bytes, from the type label.
  std::optional<std::uint8_t> type_options{};   ///< Options of the encoder, from the type label.
  std::optional<std::uint32_t> periods{};  ///< Number of sine periods of a turn, from the description in data field FF.
  /// Number of turns that the encoder counts, from the description in data field FF.
  std::optional<std::uint32_t> range{};
  std::optional<author::AsciiText> serial_number{};  ///< Serial number of the encoder.
  std::optional<author::AsciiText> version{};        ///< Program version of the encoder, with its date.
  /// Address that a request gives to the encoder, or that a command has given to it.
  std::optional<std::uint8_t> new_address{};
  /// Whether the host sent a request that stores something; false if the encoder had the value already.
  std::optional<bool> written{};
  /// Scan: true if no reply of the address was valid and at least one was damaged.
  std::optional<bool> clash{};
};

/// Table of the fields in which requests, replies and results of procedures are reported.
inline constexpr auto fields = [] {
  using author::field;
  using author::in_hex;
  return author::fields_of<Values>(
      in_hex(field<&Values::encoder_address>("encoder_address", "", "address of the encoder", Role::encoder)),
      field<&Values::command>("command", "", "command of the request", Role::exchange),
      field<&Values::singleturn>("singleturn", "counts", "position within the turn", Role::position),
      field<&Values::multiturn>("multiturn", "revolutions", "turns", Role::turns),
      field<&Values::status>("status", "error bit of the reply", status_flags),
      field<&Values::alarms>("alarms", "alarms, from the status codes", alarm_flags),
      in_hex(field<&Values::status_code>("status_code", "", "status of the encoder; 0: no error")),
      field<&Values::status_text>("status_text", "", "the status code in words"),
      field<&Values::position>("position", "counts", "position with its turns that is set"),
      in_hex(field<&Values::channel>("channel", "", "channel of the analog value; 0x48: the temperature")),
      field<&Values::analog_value>("analog_value", "", "value of the channel, in the encoder's own unit"),
      field<&Values::temperature>("temperature_c", "degC", "of the encoder"),
      field<&Values::counter>("counter", "", "value of the counter"), field<&Values::field>("field", "", "data field"),
      field<&Values::address>("address", "", "address in the data field"),
      field<&Values::count>("count", "", "number of bytes"),
      field<&Values::value>("value", "", "the byte in the data field", Role::value),
      field<&Values::data>("data", "", "bytes of the data field from `address` on", Role::data),
      field<&Values::exists>("exists", "", "whether the data field exists"),
      field<&Values::writable>("writable", "", "whether the data field can be written"),
      field<&Values::needs_code>("needs_code", "", "whether the data field needs its access code"),
      field<&Values::number>("number", "", "number of the access code"),
      field<&Values::size>("size", "bytes", "size of the data field"),
      field<&Values::free_memory>("free_memory", "bytes", "for which data fields can still be created"),
      in_hex(field<&Values::interface_setting>("interface", "", "interface setting (Mode_485)")),
      field<&Values::baud>("baud", "", "bits per second of the interface setting"),
      in_hex(field<&Values::type>("type", "", "type of the encoder", Role::identity)),
      field<&Values::type_name>("type_name", "", "families of encoders of this type"),
      field<&Values::memory_size>("memory_size", "bytes", "of the whole memory"),
      in_hex(field<&Values::type_options>("type_options", "", "options of the type label")),
      field<&Values::periods>("periods", "", "sine periods of a turn, from data field FF"),
      field<&Values::range>("range", "revolutions", "turns that the encoder counts, from data field FF"),
      field<&Values::serial_number>("serial_number", "", "serial number"),
      field<&Values::version>("version", "", "program version with its date"),
      in_hex(field<&Values::new_address>("new_address", "", "address from now on")),
      field<&Values::written>("written", "", "false when the encoder had the value already", Role::written),
      field<&Values::clash>("clash", "", "the reply was damaged: two encoders of one address, or a bad line",
                            Role::clash));
}();

/// Returns the name of a command.
[[nodiscard]] constexpr std::string_view name_of(CommandCode command) {
  switch (command) {
    case CommandCode::position:
      return "position";
    case CommandCode::set_position:
      return "set_position";
    case CommandCode::analog_value:
      return "analog_value";
    case CommandCode::counter:
      return "counter";
    case CommandCode::count_up:
      return "count_up";
    case CommandCode::clear_counter:
      return "clear_counter";
    case CommandCode::read_data:
      return "read_data";
    case CommandCode::store_data:
      return "store_data";
    case CommandCode::field_status:
      return "field_status";
    case CommandCode::create_field:
      return "create_field";
    case CommandCode::free_memory:
      return "free_memory";
    case CommandCode::access_code:
      return "access_code";
    case CommandCode::status:
      return "status";
    case CommandCode::type_label:
      return "type_label";
    case CommandCode::reset:
      return "reset";
    case CommandCode::set_address:
      return "set_address";
    case CommandCode::serial_number:
      return "serial_number";
    case CommandCode::interface:
      return "interface";
  }
  return "";
}

/// Adds the parts of an interface setting to the values.
constexpr void show_interface(Values& all, std::uint8_t setting) {
  all.interface_setting = setting;
  const unsigned rate = setting & rate_bits;
  if (rate < rates.size()) all.baud = rates[rate];
}
/// Adds the parts of a data field's status to the values.
constexpr void show_field_status(Values& all, std::uint8_t status) {
  all.exists = (status & field_status::exists) != 0;
  if (!*all.exists) return;
  all.writable = (status & field_status::writable) != 0;
  all.needs_code = (status & field_status::needs_code) != 0;
  all.number = static_cast<std::uint8_t>((status & field_status::code_number) >> 4);
  all.size = static_cast<std::uint16_t>(field_size(status));
}
/// Adds a status code and its meaning to the values.
constexpr void show_status(Values& all, std::uint8_t code) {
  all.status_code = code;
  all.status_text = text_of_status(code);
}
/// Adds the parts of a type label to the values.
constexpr void show_label(Values& all, const Reply& reply) {
  show_interface(all, reply.label[0]);
  all.type = reply.label[1];
  all.type_name = name_of_type(reply.label[1]);
  all.memory_size = static_cast<std::uint32_t>(block_size * reply.label[2]);
  all.type_options = reply.label[3];
}

/// Returns the values of the fields of a request.
[[nodiscard]] constexpr Values values_of(const Request& request) {
  Values all{.encoder_address = request.address, .command = name_of(request.command)};
  switch (request.command) {
    case CommandCode::set_position:
      all.position = request.position;
      break;
    case CommandCode::analog_value:
      all.channel = request.subject;
      break;
    case CommandCode::read_data:
    case CommandCode::store_data:
      all.field = request.subject;
      all.address = request.first;
      all.count = request.count;
      if (request.data.size() == 1) all.value = request.data[0];
      if (request.data.size() > 1) all.data = request.data.view();
      break;
    case CommandCode::field_status:
      all.field = request.subject;
      break;
    case CommandCode::create_field:
      all.field = request.subject;
      show_field_status(all, request.new_value);
      break;
    case CommandCode::access_code:
      all.number = request.subject;
      break;
    case CommandCode::set_address:
      all.new_address = request.subject;
      break;
    case CommandCode::interface:
      show_interface(all, request.subject);
      break;
    default:
      break;
  }
  return all;
}

/// Returns the values of the fields of a reply. Byte and text values refer to the bytes of `reply`, which must outlive
/// them.
[[nodiscard]] constexpr Values values_of(const Format& format, const Request& request, const Reply& reply) {
  Request without_data = request;  // a reply does not contain the bytes that its request stores
  without_data.data.clear();
  Values all = values_of(without_data);
  if (request.command != CommandCode::set_address) all.encoder_address = reply.address;
  all.status = reply.has_error ? 1 : 0;
  switch (request.command) {
    case CommandCode::position:
      all.singleturn = static_cast<std::uint32_t>(reply.value & low_mask(format.resolution().singleturn_bits));
      if (format.resolution().multiturn_bits != 0) all.multiturn = reply.value >> format.resolution().singleturn_bits;
      if (!reply.has_error || reply.alarms != 0) all.alarms = reply.alarms;
      break;
    case CommandCode::analog_value:
      if (request.subject == temperature_channel) {
        all.temperature = static_cast<std::int16_t>(reply.value);
      } else {
        all.analog_value = static_cast<std::int16_t>(reply.value);
      }
      break;
    case CommandCode::counter:
      all.counter = reply.value;
      break;
    case CommandCode::read_data:
      if (reply.data.size() == 1) all.value = reply.data[0];
      if (reply.data.size() > 1) all.data = reply.data.view();
      break;
    case CommandCode::field_status:
      show_field_status(all, static_cast<std::uint8_t>(reply.value));
      break;
    case CommandCode::free_memory:
      all.free_memory = static_cast<std::uint32_t>(reply.value * (format.free_bytes == 1 ? block_size : 1));
      break;
    case CommandCode::status:
      show_status(all, static_cast<std::uint8_t>(reply.value));
      break;
    case CommandCode::type_label:
      show_label(all, reply);
      break;
    case CommandCode::serial_number:
      all.serial_number = author::AsciiText{reply.data.view().first(format.serial_bytes)};
      all.version = author::AsciiText{reply.data.view().subspan(format.serial_bytes)};
      break;
    default:
      break;
  }
  return all;
}

/// Returns the bits of a valid reply that carry `field`; no bits if the reply does not carry it.
[[nodiscard]] constexpr BitRanges place_of(const Format& format, Bytes reply, const FieldInfo& field) {
  using author::big_endian_bits;
  using author::bits_of;
  const auto command = static_cast<CommandCode>(reply[1] & ~error_bit);
  if (&field == fields.of<&Values::status>()) return bits_of(1, 7, 1);
  if (&field == fields.of<&Values::encoder_address>()) {
    return command == CommandCode::set_address ? BitRanges{} : bits_of(0, 0, 8);
  }
  if (command == CommandCode::position && reply.size() == shortest_frame + 4) {
    const Resolution bits = format.resolution();
    if (&field == fields.of<&Values::singleturn>()) return big_endian_bits(2, 4, bits.singleturn_bits);
    if (&field == fields.of<&Values::multiturn>()) {
      return big_endian_bits(2, 4, bits.multiturn_bits, bits.singleturn_bits);
    }
  }
  const std::size_t data = reply.size() - shortest_frame;
  if (&field == fields.of<&Values::counter>()) return big_endian_bits(2, data, 8 * data);
  if (&field == fields.of<&Values::status_code>()) return bits_of(1 + data, 0, 8);
  if (&field == fields.of<&Values::type>()) return bits_of(3, 0, 8);
  return {};
}

}  // namespace absenc::hiperface
