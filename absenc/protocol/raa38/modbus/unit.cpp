// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/unit.hpp"

#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/raa38/modbus/device.hpp"
#include "absenc/protocol/raa38/modbus/explain.hpp"
#include "absenc/protocol/raa38/modbus/fields.hpp"
#include "absenc/protocol/raa38/modbus/options.hpp"
#include "absenc/protocol/raa38/modbus/probe.hpp"
#include "absenc/protocol/raa38/modbus/procedures.hpp"
#include "absenc/protocol/raa38/modbus/vectors.hpp"

namespace absenc::raa38 {

namespace rtu {
namespace {

using author::command;

constexpr Argument force{"force",    "1: also what is so already (each time wears the memory)", 0, 1, 0, false,
                         Role::force};
constexpr std::array<Argument, 2> address_arguments{
    {{"address", "the new one", modbus::first_address, modbus::last_address}, force}};
constexpr std::array<Argument, 2> baud_arguments{
    {{"baud", "2400, 4800, 9600, 19200 or 57600", bauds.front(), bauds.back()}, force}};
constexpr std::array<Argument, 1> direction_arguments{
    {{"direction", "1: positive, 2: negative", parameter::positive, parameter::negative}}};
constexpr std::array<Argument, 1> zero_arguments{{force}};
constexpr std::array<Argument, 2> scan_arguments{
    {{"first", "address to ask", modbus::first_address, modbus::last_address, modbus::first_address, false},
     {"last", "address to ask", modbus::first_address, modbus::last_address, modbus::last_address, false}}};

// ---- The one request that does the command's work; procedures send more.

constexpr Request to_look(const Format& format) { return read_request(format); }
constexpr Request to_read(const Format& format, Arguments) { return read_request(format); }
constexpr Request to_ask_address(const Format&, Arguments) {
  return {.function = function::ask_address, .address = any_address};
}
constexpr Request to_set(const Format& format, std::uint8_t code, std::int64_t value) {
  return {.function = code, .address = format.address, .value = static_cast<std::uint8_t>(value)};
}
constexpr Request to_set_address(const Format& format, Arguments arguments) {
  return to_set(format, function::set_address, arguments[0]);
}
constexpr Request to_set_direction(const Format& format, Arguments arguments) {
  return to_set(format, function::set_parameter, arguments[0]);
}
constexpr Request to_set_zero(const Format& format, Arguments) {
  return to_set(format, function::set_parameter, parameter::zero);
}
constexpr Result<Request> to_set_baud(const Format& format, Arguments arguments) {
  const std::optional<std::size_t> index = baud_index(static_cast<std::uint64_t>(arguments[0]));
  if (!index) return Error::invalid_argument;
  return to_set(format, function::set_parameter, baud_parameters[*index]);
}

constexpr bool has_too_few_registers(const Format& format) { return format.asked() == 1 && format.bits > 16; }

// ---- Where a frame ends

constexpr bool is_good(Bytes bytes, std::size_t size) {
  return bytes.size() >= size && modbus::crc_order(bytes.first(size)) == CrcOrder::low_first;
}

// Silence tells frames apart. In a mere run of bytes three data bytes counted as four are told from four by the CRC,
// and where a 00 follows, which the CRC does not see, by what the position can be.
std::size_t length_in_run(const Format& format, const Request& request, Bytes bytes) {
  const std::size_t length = reply_length(request, bytes);
  if (length != 9 || !is_good(bytes, 8)) return length;
  if (!is_good(bytes, 9)) return 8;
  return decode_reply(format, request, bytes.first(9)) ? 9 : 8;
}

Delimit delimit(const Options& values, Direction way, Bytes bytes) {
  if (bytes.size() < 3) return {Delimit::Kind::incomplete, modbus::shortest_frame};
  const std::uint8_t code = bytes[1];
  const bool refusal = code == (function::read | modbus::refusal_bit);
  if (!function::is_known(code) && (way == Direction::request || !refusal)) return {Delimit::Kind::no_frame};
  std::size_t length = request_length(code);
  if (way == Direction::reply) {
    Format format = options.format(values);
    format.address = bytes[0];
    Request request = read_request(format);
    request.function = refusal ? function::read : code;
    request.registers = bytes[2] == 2 ? 1 : 2;
    length = length_in_run(format, request, bytes);
  }
  return {bytes.size() < length ? Delimit::Kind::incomplete : Delimit::Kind::complete, length};
}

// ---- What is declared

// A position beside other things, as several conversations report it.
constexpr void put_position(FieldSink& sink, const Format& format, const Reading& reading) {
  const auto singleturn = static_cast<std::uint32_t>(reading.singleturn);
  fields.put(sink, {.singleturn = singleturn, .angle = degrees(singleturn, format.bits)});
  sink.put_reading(reading);
}

// How each setting is told.
struct SetAddress : Set {};
struct SetBaud : Set {};
struct SetDirection : Set {};
struct SetZero : Set {};

struct Definition {
  using Protocol = rtu::Protocol;
  using Encoder = VirtualEncoder;
  static constexpr std::string_view id = "raa38-modbus", name = "RAA38S6 over Modbus RTU",
                                    document = "RAA38S6 Operation Manual, 3.1.7";
  static constexpr LinkKind link = LinkKind::half_duplex;
  static constexpr std::size_t frames_size = 1300;
  static constexpr auto options = rtu::options;
  static constexpr auto fields = rtu::fields;
  static constexpr auto vectors = rtu::vectors;
  static constexpr auto probe = rtu::probe;
  static constexpr auto delimit = rtu::delimit;
  static constexpr std::array models{author::ModelText{"RAA38S6", "single-turn, 10 to 21 bits (option bits)", 0, ""}};
  // Between the longest pause inside a frame, 1.5 characters, and the shortest between two, 3.5.
  static constexpr LineTiming timing{.pause_bits = 25, .turnaround_limit = answer_limit};

  static constexpr Command position{"position", Verb::read, 0, "position within the turn"};
  static constexpr std::array commands{
      author::reading<Definition, Protocol, to_look, ReadPosition>(position).or_when(
          has_too_few_registers, command<Definition, Protocol, Looked, look_once, to_read>(position)),
      command<Definition, Protocol, Address, ask_address, to_ask_address>(
          {"address", Verb::config_get, 0, "address of the encoder"}),
      command<Definition, Protocol, Baud, find_baud, to_read>(
          {"baud", Verb::config_get, 0, "the baud rate at which it answers", {}, false, false}),
      command<Definition, Protocol, Seen, look_at_direction, to_read>(
          {"direction", Verb::config_get, 0, "in which direction it counts: only the position shows it"}),
      command<Definition, Protocol, SetAddress, set_address, to_set_address>(
          {"set-address", Verb::config_set, 0, "give it another address", address_arguments, true, false, "address",
           "address"}),
      command<Definition, Protocol, SetBaud, set_baud, to_set_baud>(
          {"set-baud", Verb::config_set, 0, "give it another baud rate", baud_arguments, true, false, "baud", "baud"}),
      command<Definition, Protocol, SetDirection, set_direction, to_set_direction>(
          {"set-direction", Verb::config_set, 0, "set in which direction it counts", direction_arguments, true, false,
           "direction"}),
      command<Definition, Protocol, SetZero, set_zero, to_set_zero>(
          {"zero", Verb::zero, 0, "make this the zero of the turn", zero_arguments, true, false}),
      command<Definition, Protocol, Slaves, scan, to_ask_address>(
          {"scan", Verb::scan, 0, "who answers on the line", scan_arguments, false, false}),
  };

  static constexpr LineSettings line(const Format& format) { return format.line(); }
  static constexpr Resolution resolution(const Format& format) { return {.singleturn_bits = format.bits}; }
  static constexpr Request guess_request(const Format& format, Bytes reply) { return assumed_request(format, reply); }
  static Explanation explain(const Format& format, Error error, Bytes asked, Bytes reply) {
    const Result<Request> request = asked.empty() ? assumed_request(format, reply) : decode_request(asked);
    return request ? rtu::explain(*request, error, reply) : explain_request(error, asked);
  }

  static constexpr void put(FieldSink& sink, const Format&, const Request& request) {
    fields.put(sink, values_of(request));
  }
  static constexpr void put(FieldSink& sink, const Format& format, const Request&, const Reply& reply) {
    fields.put(sink, values_of(format, reply));
  }
  static void put(FieldSink& sink, const Format& format, const Looked& found) {
    put_position(sink, format, found.reading);
  }
  static void put(FieldSink& sink, const Format&, const Seen& found) {
    fields.put(sink,
               {.singleturn = found.singleturn, .direction = "the encoder does not tell: turn the shaft and see"});
  }
  static void put(FieldSink& sink, const Format&, const Address& found) {
    fields.put(sink, {.address = found.address});
  }
  static void put(FieldSink& sink, const Format&, const Baud& found) { fields.put(sink, {.baud = bauds[found.index]}); }
  static void put(FieldSink& sink, const Format&, const SetAddress& found) {
    fields.put(sink, {.address = static_cast<std::uint16_t>(found.value), .written = found.written});
  }
  static void put(FieldSink& sink, const Format&, const SetBaud& found) {
    fields.put(sink, {.baud = static_cast<std::uint32_t>(found.value), .written = found.written});
  }
  static void put(FieldSink& sink, const Format&, const SetDirection& found) {
    const auto value = static_cast<std::uint8_t>(found.value);
    fields.put(
        sink,
        {.parameter = value, .setting = name_of_setting(value), .effect = found.effect, .written = found.written});
  }
  static void put(FieldSink& sink, const Format& format, const SetZero& found) {
    put_position(sink, format, found.reading);
    fields.put(sink, {.written = found.written});
  }
  static void put(FieldSink& sink, const Format&, const Slaves& found) {
    using Kind = Slaves::Kind;
    for (std::size_t i = 0; i < found.at.size(); ++i) {
      const Kind kind = found.at[i];
      if (kind == Kind::none) continue;
      fields.put(sink, {.encoder_address = static_cast<std::uint16_t>(i),
                        .clash = kind == Kind::clash,
                        .refuses = kind == Kind::refuses ? std::optional<bool>(true) : std::nullopt});
    }
  }
};

}  // namespace
}  // namespace rtu

constinit const Unit modbus_unit = author::UnitOf<rtu::Definition>::make();

}  // namespace absenc::raa38
