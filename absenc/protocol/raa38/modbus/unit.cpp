// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/unit.hpp"

#include <array>

#include "absenc/protocol/author/bits.hpp"
#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/raa38/modbus/device.hpp"
#include "absenc/protocol/raa38/modbus/host.hpp"
#include "absenc/protocol/raa38/modbus/vectors.hpp"
#include "absenc/protocol/raa38/probe.hpp"

namespace absenc::raa38 {

namespace rtu {
namespace {

using author::field;
using author::option;
using author::probeable;

constexpr std::array<std::string_view, 3> register_choices{"auto", "1", "2"};
constexpr std::array<std::string_view, bauds.size()> baud_choices{"2400", "4800", "9600", "19200", "57600"};
constexpr std::array<std::string_view, 3> data_choices{"four", "three", "three_as_four"};
constexpr std::array<std::string_view, 2> crc_choices{"low_first", "high_first"};

constexpr auto options = author::OptionsOf{
    author::with_role<Role::encoder>(
        option<&Format::address>("address", "of the encoder", modbus::first_address, modbus::last_address)),
    probeable(option<&Format::bits>("bits", "of the position within the turn", 10, 21)),
    probeable(
        option<&Format::registers>("registers", "to ask for; auto: one up to 16 bits, two above", register_choices)),
    author::with_role<Role::rate>(option<&Format::baud>("baud", "bits a second", baud_choices)),
    option<&Format::data>("reply_data",
                          "virtual encoder: bytes of data for two registers, and how many the byte count says",
                          data_choices),
    option<&Format::address_crc>("address_crc",
                                 "virtual encoder: which byte of the CRC comes first in its reply to A0; the document "
                                 "can be read in both ways",
                                 crc_choices),
};

constexpr Argument force{
    "force", "1: also if the encoder has it already (each time wears the memory)", 0, 1, 0, false, Role::force};
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

// ---- Requests: each is the main request of a command; procedures send more

constexpr Request to_read(const Format& format, Arguments) { return read_request(format); }
constexpr Request to_ask_address(const Format&, Arguments) {
  return {.function = function::read_address, .address = any_address};
}
constexpr Request to_set(const Format& format, std::uint8_t code, std::int64_t value) {
  return {.function = code, .address = format.address, .value = static_cast<std::uint8_t>(value)};
}
template <std::uint8_t code>
constexpr Request to_give(const Format& format, Arguments arguments) {
  return to_set(format, code, arguments[0]);
}
constexpr Request to_set_zero(const Format& format, Arguments) {
  return to_set(format, function::set_parameter, parameter::zero);
}
constexpr Result<Request> to_set_baud(const Format& format, Arguments arguments) {
  const std::optional<std::size_t> index = baud_index(static_cast<std::uint64_t>(arguments[0]));
  if (!index) return Error::invalid_argument;
  return to_set(format, function::set_parameter, baud_parameters[*index]);
}

constexpr bool has_too_few_registers(const Format& format) { return format.register_count() == 1 && format.bits > 16; }

// ---- End of a frame

constexpr bool is_good(Bytes bytes, std::size_t size) {
  return bytes.size() >= size && modbus::crc_order(bytes.first(size)) == CrcOrder::low_first;
}

// Returns the likely length of a reply to `request` at the begin of `bytes`, which may have further frames behind it.
std::size_t length_in_run(const Format& format, const Request& request, Bytes bytes) {
  const std::size_t length = reply_length(request, bytes);
  if (length != 9 || !is_good(bytes, 8)) return length;
  if (!is_good(bytes, 9)) return 8;
  return decode_reply(format, request, bytes.first(9)) ? 9 : 8;
}

FrameEnd frame_end(const Options& values, Direction way, Bytes bytes) {
  if (bytes.size() < 3) return {FrameEnd::Kind::incomplete, modbus::shortest_frame};
  const std::uint8_t code = bytes[1];
  const bool refusal = code == (function::read | modbus::refusal_bit);
  if (!function::is_known(code) && (way == Direction::request || !refusal)) return {FrameEnd::Kind::no_frame};
  std::size_t length = request_length(code);
  if (way == Direction::reply) {
    Format format = options.format(values);
    format.address = bytes[0];
    Request request = read_request(format);
    request.function = refusal ? function::read : code;
    request.registers = bytes[2] == 2 ? 1 : 2;
    length = length_in_run(format, request, bytes);
  }
  return {bytes.size() < length ? FrameEnd::Kind::incomplete : FrameEnd::Kind::complete, length};
}

// ---- Evidence of captured frames for options; their address does not matter

/// Request and reply of a capture, decoded. `wrong` states an error of the capture that no option value can explain.
struct CaptureContent {
  Request request{};
  std::optional<Reply> reply{};
  std::string_view wrong{};
};

CaptureContent examine(const Capture& capture) {
  Format most{.bits = 21};
  if (!capture.reply.empty()) most.address = capture.reply[0];
  const Result<Request> request = capture.request.empty()
                                      ? assumed_request(Format{.address = most.address}, capture.reply)
                                      : decode_request(capture.request);
  if (!request) return {.wrong = text_of(request.error()).description};
  if (capture.reply.empty()) return {*request};
  const Result<Reply> reply = decode_reply(most, *request, capture.reply);
  if (reply) return {*request, *reply};
  // A refusal is a valid frame, but tells nothing about the number of position bits.
  if (reply.error() == Error::request_rejected) return {*request};
  return {.wrong = text_of(reply.error()).description};
}

std::string_view bits_contradiction(std::int64_t bits, const CaptureContent& seen) {
  if (!seen.wrong.empty() || !seen.reply || seen.request.function != function::read) return seen.wrong;
  if (seen.reply->singleturn >> bits != 0) return "the position has more bits";
  return seen.request.registers == 1 && bits > 16 ? "one register was answered, and so many bits do not fit" : "";
}

std::string_view registers_contradiction(const Format& format, const CaptureContent& seen) {
  if (!seen.wrong.empty() || seen.request.function != function::read) return seen.wrong;
  return seen.request.registers != format.register_count() ? "another number of registers was asked for" : "";
}

bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  constexpr std::string_view agrees = "agrees with all frames";
  constexpr std::size_t bits = options.find("bits");
  constexpr std::size_t registers = options.find("registers");
  const Option& range = options.infos[bits];
  const bool bits_found =
      judge_option(sink, bits, range.minimum, range.maximum, captures.size(), values.values[bits], agrees,
                   [&](std::int64_t value, std::size_t i) { return bits_contradiction(value, examine(captures[i])); });
  const bool registers_found = judge_option(sink, registers, 0, 2, captures.size(), values.values[registers], agrees,
                                            [&](std::int64_t value, std::size_t i) {
                                              Format format = options.format(values);
                                              format.registers = static_cast<unsigned>(value);
                                              return registers_contradiction(format, examine(captures[i]));
                                            });
  return bits_found && registers_found;
}

// ---- Reported fields

constexpr auto fields = author::fields_of<Values>(
    field<&Values::address>("address", "", "address of the encoder", Role::encoder),
    field<&Values::function>("function", "", "function code", Role::exchange),
    field<&Values::first_register>("first_register", "", "where reading begins"),
    field<&Values::registers>("registers", "", "how many are asked for"),
    field<&Values::singleturn>("singleturn", "counts", "position within the turn", Role::position),
    field<&Values::angle>("angle_deg", "deg", "the same as an angle", Role::of_position),
    field<&Values::new_address>("new_address", "", "address from now on"),
    field<&Values::parameter>("parameter", "", "parameter of function CC"),
    field<&Values::setting>("setting", "", "the same in words"),
    field<&Values::crc_order>("crc_order", "", "which byte of the CRC comes first", Role::exchange),
    field<&Values::baud>("baud", "bit/s", "the baud rate at which it answers"),
    field<&Values::direction>("direction", "", "in which direction it counts"),
    field<&Values::effect>("effect", "", "effect on the position"),
    field<&Values::written>("written", "", "whether the setting was sent; it is not if the encoder has it already",
                            Role::written),
    field<&Values::encoder_address>("encoder_address", "", "address that answers", Role::encoder),
    field<&Values::clash>("clash", "", "the answer is damaged every time", Role::clash),
    field<&Values::refuses>("refuses", "", "it answers with an exception: another kind of Modbus slave?"));

constexpr void show_setting(Values& values, std::uint8_t value) {
  values.parameter = value;
  values.setting = name_of_setting(value);
}
constexpr Values values_of_request(const Format&, const Request& request) {
  Values values{.function = request.function, .crc_order = "low_first"};
  if (request.function != function::read_address) values.address = request.address;
  if (request.function == function::read) {
    values.first_register = request.first_register;
    values.registers = request.registers;
  }
  if (request.function == function::set_address) values.new_address = request.value;
  if (request.function == function::set_parameter) show_setting(values, request.value);
  return values;
}
constexpr Values values_of_reply(const Format& format, const Request&, const Reply& reply) {
  Values values{.function = reply.function,
                .crc_order = reply.order == CrcOrder::high_first ? "high_first" : "low_first"};
  (reply.function == function::set_address ? values.new_address : values.address) = reply.address;
  if (reply.function == function::read) {
    values.singleturn = reply.singleturn;
    values.angle = degrees(reply.singleturn, format.bits);
  }
  if (reply.function == function::set_parameter) show_setting(values, reply.value);
  return values;
}
void put_found(FieldSink& sink, const Format&, const CommandValues& found) { fields.put(sink, found); }
void put_slaves(FieldSink& sink, const Format&, const Slaves& found) {
  using Kind = Slaves::Kind;
  for (std::size_t i = 0; i < found.at.size(); ++i) {
    const Kind kind = found.at[i];
    if (kind == Kind::none) continue;
    fields.put(sink, {.encoder_address = static_cast<std::uint16_t>(i),
                      .clash = kind == Kind::clash,
                      .refuses = kind == Kind::refuses ? std::optional<bool>(true) : std::nullopt});
  }
}

constexpr author::Report<Protocol> report{
    .put_request = author::put_values<fields, values_of_request>,
    .put_reply = author::put_values<fields, values_of_reply>,
    .explain = explain,
};
constexpr author::Finding<Format, CommandValues> found{.put = put_found};
constexpr author::Finding<Format, Slaves> slaves{.put = put_slaves};

// ---- Commands

constexpr Command position{"position", Verb::read, 0, "position within the turn"};
constexpr auto commands = std::array{
    author::reading<report, read_request, ReadPosition>(position).or_when(
        has_too_few_registers, author::command<report, found, read_position_once, to_read>(position)),
    author::command<report, found, read_address, to_ask_address>(
        {"address", Verb::config_get, 0, "address of the encoder"}),
    author::command<report, found, find_baud, to_read>(
        {"baud", Verb::config_get, 0, "the baud rate at which it answers", {}, false, false}),
    author::command<report, found, read_direction, to_read>(
        {"direction", Verb::config_get, 0, "in which direction it counts: only the position shows it"}),
    author::command<report, found, set_address, to_give<function::set_address>>(
        {"set-address", Verb::config_set, 0, "give it another address", address_arguments, true, false, "address",
         "address"}),
    author::command<report, found, set_baud, to_set_baud>(
        {"set-baud", Verb::config_set, 0, "give it another baud rate", baud_arguments, true, false, "baud", "baud"}),
    author::command<report, found, set_direction, to_give<function::set_parameter>>(
        {"set-direction", Verb::config_set, 0, "set in which direction it counts", direction_arguments, true, false,
         "direction"}),
    author::command<report, found, set_zero, to_set_zero>(
        {"zero", Verb::zero, 0, "make this the zero of the turn", zero_arguments, true, false}),
    author::command<report, slaves, scan, to_ask_address>(
        {"scan", Verb::scan, 0, "addresses that answer on the line", scan_arguments, false, false}),
};

// ---- Declaration

constexpr auto models = std::array{author::ModelText{"RAA38S6", "single-turn, 10 to 21 bits (option bits)", 0, ""}};

BitRanges bits_in(const Options& values, Frame, Frame reply, const FieldInfo& field) {
  const std::size_t address_at = reply.bytes[1] == function::read_address ? 2 : 0;
  if (&field == fields.of<&Values::address>()) return author::bits_of(address_at, 0, 8);
  if (&field == fields.of<&Values::new_address>()) return author::bits_of(0, 0, 8);
  if (&field == fields.of<&Values::function>()) return author::bits_of(1, 0, 8);
  if (&field == fields.of<&Values::parameter>()) return author::bits_of(2, 0, 8);
  if (&field != fields.of<&Values::singleturn>()) return {};
  return author::big_endian_bits(3, reply.bytes.size() - 3 - modbus::crc_size, options.format(values).bits);
}
constexpr Result<Request> guess_request(const Format& format, Bytes reply) { return assumed_request(format, reply); }

constexpr author::Declaration<Protocol, VirtualEncoder> declaration{
    .id = "raa38-modbus",
    .name = "RAA38S6 over Modbus RTU",
    .document = "Absolute Encoder Operation Manual, RAA38S6 series",
    .lookalikes = "any Modbus device that has the same registers",
    .link = LinkKind::half_duplex,
    .options = options.infos,
    .format = author::format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .frames_size = 1300,
    .report = report,
    .guess_request = guess_request,
    .frame_end = frame_end,
    .bits = bits_in,
    .probe = probe,
    // The pause in bits that ends a frame lies between 1.5 and 3.5 characters.
    .timing = {.pause_bits = 25, .turnaround_limit = answer_limit},
};

}  // namespace
}  // namespace rtu

constinit const Unit modbus_unit = author::Descriptor<rtu::declaration>::make();

}  // namespace absenc::raa38
