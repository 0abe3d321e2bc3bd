// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "absenc/protocol/make.hpp"
#include "absenc/protocol/raa38/modbus/explain.hpp"
#include "absenc/protocol/raa38/modbus/options.hpp"
#include "absenc/protocol/raa38/modbus/probe.hpp"
#include "absenc/protocol/raa38/modbus/settings.hpp"
#include "absenc/protocol/raa38/modbus/vectors.hpp"
#include "absenc/protocol/raa38/unit.hpp"

namespace absenc::raa38 {

namespace {

using namespace rtu;

constexpr std::array<Model, 1> models{{
    {"RAA38S6", "single-turn, 10 to 21 bits (option bits)", 0, {}},
}};

constexpr Argument force{"force", "1: also what is so already (each time wears the memory)", 0, 1, 0, false};
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

constexpr std::string_view address = "address";
constexpr std::string_view baud = "baud";
constexpr std::string_view direction = "direction";

constexpr std::array<Command, 9> commands{{
    {"position", Verb::read, function::read, "position within the turn"},
    {address, Verb::config_get, function::ask_address, "address of the encoder"},
    {baud, Verb::config_get, function::read, "the baud rate at which it answers", {}, false, false},
    {direction, Verb::config_get, function::read, "in which direction it counts: only the position shows it"},
    {"set-address", Verb::config_set, function::set_address, "give it another address", address_arguments, true, false,
     address, address},
    {"set-baud", Verb::config_set, function::set_parameter, "give it another baud rate", baud_arguments, true, false,
     baud, baud},
    {"set-direction", Verb::config_set, function::set_parameter, "set in which direction it counts",
     direction_arguments, true, false, direction},
    {"zero", Verb::zero, function::set_parameter, "make this the zero of the turn", zero_arguments, true, false},
    {"scan", Verb::scan, function::ask_address, "who answers on the line", scan_arguments, false, false},
}};

Error decode_frame(const Options& values, Frame request, Frame reply, FieldSink& sink) {
  return decode(to_format(values), request.bytes, reply.bytes, sink);
}

// The one frame that does the command's work; procedures send more.
Result<Request> request_of(const Format& format, const Command& command, Arguments arguments) {
  Request request = read_request(format);
  request.function = command.id;
  if (command.id == function::ask_address) request.address = any_address;
  if (command.verb == Verb::zero) request.value = parameter::zero;
  if (command.verb != Verb::config_set) return request;
  request.value = static_cast<std::uint8_t>(arguments[0]);
  if (command.reads_back != baud) return request;
  const std::optional<std::size_t> index = baud_index(static_cast<std::uint64_t>(arguments[0]));
  if (!index) return Error::invalid_argument;
  request.value = baud_parameters[*index];
  return request;
}

Result<std::size_t> encode(const Options& values, const Command& command, Arguments arguments, MutableBytes request) {
  const Result<Request> wanted = request_of(to_format(values), command, arguments);
  if (!wanted) return wanted.error();
  const RequestBytes bytes = encode_request(*wanted);
  if (bytes.size() > request.size()) return Error::buffer_too_small;
  std::copy_n(bytes.view().begin(), bytes.size(), request.begin());
  return bytes.size();
}

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
    Format format = to_format(values);
    format.address = bytes[0];
    Request request = read_request(format);
    request.function = refusal ? function::read : code;
    request.registers = bytes[2] == 2 ? 1 : 2;
    length = length_in_run(format, request, bytes);
  }
  return {bytes.size() < length ? Delimit::Kind::incomplete : Delimit::Kind::complete, length};
}

Any<Conversation> host(const Options& values, const Command& command, Arguments arguments,
                       std::span<std::byte> storage) {
  const Format format = to_format(values);
  const auto argument = [arguments](std::size_t i) { return static_cast<std::uint8_t>(arguments[i]); };
  const auto wear = [&](std::size_t i) { return arguments[i] != 0 ? Wear::accept : Wear::avoid; };
  switch (command.verb) {
    case Verb::config_get:
      if (command.name == address) return make_host<ReadAddress>(storage, format);
      if (command.name == baud) return make_host<FindBaud>(storage, format);
      return make_host<ReadDirection>(storage, format);
    case Verb::config_set:
      if (command.reads_back == address) return make_host<SetAddress>(storage, format, argument(0), wear(1));
      if (command.reads_back == direction) return make_host<SetDirection>(storage, format, argument(0));
      return make_host<SetBaud>(storage, format, static_cast<std::uint32_t>(arguments[0]), wear(1));
    case Verb::zero:
      return make_host<Zero>(storage, format, wear(0));
    case Verb::scan:
      return make_host<Scan>(storage, format, argument(0), argument(1));
    default:
      return make_host<ReadPosition>(storage, format);
  }
}

Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
  return make_device<VirtualEncoder>(storage, to_format(values), shaft, static_cast<Data>(values[option_reply_data]));
}

Resolution resolution(const Options& values) { return {.singleturn_bits = to_format(values).bits}; }

Explanation explain_frame(const Options& values, Error error, Frame request, Frame reply) {
  const Result<Request> asked =
      request.bytes.empty() ? assumed_request(to_format(values), reply.bytes) : decode_request(request.bytes);
  return asked ? explain(*asked, error, reply.bytes) : explain_request(error, request.bytes);
}

LineSettings settings(const Options& values) { return to_format(values).line(); }

}  // namespace

constinit const Unit modbus_unit{
    .id = "raa38-modbus",
    .name = "RAA38S6 over Modbus RTU",
    .document = "RAA38S6 Operation Manual, 3.1.7",
    .link = LinkKind::half_duplex,
    .line = line_settings,
    .options = options,
    .models = models,
    .fields = fields,
    .commands = commands,
    .vectors = vectors,
    .status = nullptr,
    .alarms = nullptr,
    .host_storage = std::max({sizeof(ReadPosition), sizeof(ReadAddress), sizeof(FindBaud), sizeof(ReadDirection),
                              sizeof(Scan), sizeof(SetAddress), sizeof(SetBaud), sizeof(SetDirection), sizeof(Zero)}),
    .device_storage = sizeof(VirtualEncoder),
    .decode = decode_frame,
    .encode = encode,
    .delimit = delimit,
    .host = host,
    .device = device,
    .resolution = resolution,
    .explain = explain_frame,
    .settings = settings,
    .probe = probe,
    // Between the longest pause inside a frame, 1.5 characters, and the shortest between two, 3.5.
    .timing = {.pause_bits = 25, .turnaround_limit = answer_limit},
};

}  // namespace absenc::raa38
