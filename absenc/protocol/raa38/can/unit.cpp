// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "absenc/protocol/make.hpp"
#include "absenc/protocol/raa38/can/device.hpp"
#include "absenc/protocol/raa38/can/host.hpp"
#include "absenc/protocol/raa38/can/survey.hpp"
#include "absenc/protocol/raa38/can/vectors.hpp"
#include "absenc/protocol/raa38/unit.hpp"

namespace absenc::raa38 {

namespace can {
namespace {

enum OptionIndex : std::size_t {
  option_bits,
  option_node,
  option_bitrate,
  option_listen,
  option_positive,
  option_negative,
  option_cyclic,
  option_answer_id,
};

constexpr std::array<std::string_view, 3> rate_choices{"1000000", "500000", "250000"};
constexpr std::array<std::string_view, 2> answer_choices{"7e5", "7e4"};

constexpr std::array<Option, 8> options{{
    {.name = "bits", .meaning = "of the position", .default_value = 14, .minimum = 10, .maximum = 21},
    {.name = "node",
     .meaning = "number of the encoder on the bus",
     .default_value = 0x20,
     .minimum = 1,
     .maximum = 255},
    {.name = "bitrate", .meaning = "bits a second on the bus", .default_value = 2, .choices = rate_choices},
    {.name = "listen",
     .meaning = "read what the node sends by itself instead of asking for it",
     .default_value = 0,
     .choices = boolean_choices},
    {.name = "positive_value",
     .meaning = "what command 22 carries to count up; the document does not say",
     .default_value = 0,
     .minimum = 0,
     .maximum = 255},
    {.name = "negative_value",
     .meaning = "what command 22 carries to count down",
     .default_value = 1,
     .minimum = 0,
     .maximum = 255},
    {.name = "cyclic",
     .meaning = "virtual encoder: readings a second that it sends unasked after power on",
     .default_value = 10,
     .minimum = 0,
     .maximum = 255},
    {.name = "answer_id",
     .meaning = "virtual encoder: identifier on which it answers configuration commands",
     .default_value = 0,
     .choices = answer_choices},
}};
static_assert(options[option_answer_id].name == "answer_id" && options[option_positive].name == "positive_value");

constexpr std::array<Model, 1> models{{{"RAA38S6", "one turn of 10 to 21 bits: option bits", 0, {}}}};

constexpr Argument force{"force", "1: write even what is set already", 0, 1, 0, false};
constexpr std::array<Argument, 1> cyclic_arguments{{{"readings", "a second", 1, 255}}};
constexpr std::array<Argument, 2> node_arguments{{{"node", "new number", 1, 255}, force}};
constexpr std::array<Argument, 2> rate_arguments{{{"rate", "1000000, 500000 or 250000", 1, 1'000'000}, force}};
constexpr std::array<Argument, 1> direction_arguments{{{"direction", "0: positive, 1: negative", 0, 1}}};

constexpr std::string_view listen = "listen";
constexpr std::string_view stop = "stop";

constexpr std::array<Command, 11> commands{{
    {"position", Verb::read, command::read, "position"},
    {listen, Verb::read_part, command::read, "the next position that the node sends by itself"},
    {"start", Verb::run, command::start, "start the node", {}, true, false},
    {"cyclic", Verb::run, command::cyclic, "let the node send so many readings a second by itself", cyclic_arguments,
     true, false},
    {stop, Verb::run, command::cyclic, "let it send none by itself", {}, true, false},
    {"zero", Verb::zero, command::zero, "make this the zero of the turn", {}, true, false},
    {"scan", Verb::scan, command::read, "who is on the bus", {}, false, false},
    {"node", Verb::config_get, command::read, "number of the node", {}, false, false},
    {"set-node", Verb::config_set, configuration::node, "give the only node on the bus another number", node_arguments,
     true, false, "node"},
    {"bitrate", Verb::config_set, configuration::rate, "set the bit rate of the only node on the bus", rate_arguments,
     true, false},
    {"direction", Verb::config_set, command::direction, "set the counting direction", direction_arguments, true, false},
}};

Format to_format(const Options& values) {
  constexpr std::array<std::uint32_t, 3> bit_rates{1'000'000, 500'000, 250'000};
  return {.bits = static_cast<unsigned>(values[option_bits]),
          .node = static_cast<std::uint8_t>(values[option_node]),
          .rate = bit_rates[static_cast<std::size_t>(values[option_bitrate])],
          .positive = static_cast<std::uint8_t>(values[option_positive]),
          .negative = static_cast<std::uint8_t>(values[option_negative])};
}

Error decode_frame(const Options& values, Frame request, Frame reply, FieldSink& sink) {
  return decode(to_format(values), request.can, reply.can, sink);
}

// The one frame that does the command's work.
Result<CanFrame> request_of(const Format& format, const Command& command, Arguments arguments) {
  switch (command.id) {
    case command::cyclic:
      return encode_command(format.node, command.id,
                            command.name == stop ? std::uint8_t{0} : static_cast<std::uint8_t>(arguments[0]));
    case command::direction:
      return encode_command(format.node, command.id, arguments[0] == 0 ? format.positive : format.negative);
    case configuration::node:
      return encode_configuration(command.id, static_cast<std::uint8_t>(arguments[0]));
    case configuration::rate:
      if (rate_of_bits(arguments[0]) == nullptr) return Error::invalid_argument;
      return encode_configuration(command.id, 0, rate_of_bits(arguments[0])->index);
    default:
      return encode_command(format.node, command.id);
  }
}

// "220:8020000000000000"
Result<std::size_t> encode(const Options& values, const Command& command, Arguments arguments, MutableBytes request) {
  constexpr std::size_t length = 4 + 2 * frame_size;
  constexpr std::string_view digits = "0123456789abcdef";
  const Result<CanFrame> frame = request_of(to_format(values), command, arguments);
  if (!frame) return frame.error();
  if (request.size() < length) return Error::buffer_too_small;
  const auto put_digit = [&](std::size_t at, unsigned value) {
    request[at] = static_cast<std::uint8_t>(digits[value & 15]);
  };
  for (unsigned i = 0; i < 3; ++i) put_digit(i, frame->id >> (8 - 4 * i));
  request[3] = ':';
  for (std::size_t i = 0; i < frame_size; ++i) {
    put_digit(4 + 2 * i, frame->data[i] >> 4);
    put_digit(5 + 2 * i, frame->data[i]);
  }
  return length;
}

// The controller of the bus does it.
Delimit delimit(const Options&, Direction, Bytes bytes) { return {Delimit::Kind::complete, bytes.size()}; }

Any<Conversation> host(const Options& values, const Command& command, Arguments arguments,
                       std::span<std::byte> storage) {
  const Format format = to_format(values);
  const bool forced = arguments.size() == 2 && arguments[1] != 0;
  switch (command.verb) {
    case Verb::read:
      return make_host<Read>(storage, format, values[option_listen] != 0 ? Read::Way::listen : Read::Way::ask);
    case Verb::read_part:
      return make_host<Read>(storage, format, Read::Way::listen);
    case Verb::zero:
      return make_host<Zero>(storage, format);
    case Verb::scan:
      return make_host<Scan>(storage, format);
    case Verb::config_get:
      return make_host<FindNode>(storage, format);
    case Verb::run:
      if (command.id == command::start) return make_host<Read>(storage, format, Read::Way::start);
      return make_host<SetCyclic>(storage, format,
                                  command.name == stop ? std::uint8_t{0} : static_cast<std::uint8_t>(arguments[0]));
    case Verb::config_set:
      if (command.id == command::direction) return make_host<SetDirection>(storage, format, arguments[0] != 0);
      if (command.id == configuration::rate) return make_host<SetRate>(storage, format, arguments[0], forced);
      return make_host<SetNode>(storage, format, static_cast<std::uint8_t>(arguments[0]), forced);
    default:
      return {};
  }
}

Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
  const NodeSettings settings{.readings_per_s = static_cast<std::uint8_t>(values[option_cyclic]),
                              .configuration_answer = values[option_answer_id] == 0 ? 0x7E5u : 0x7E4u};
  return make_device<VirtualNode>(storage, to_format(values), shaft, settings);
}

Resolution resolution(const Options& values) { return {.singleturn_bits = static_cast<unsigned>(values[option_bits])}; }

// The CRC of CAN is the controller's: here only what must be as it is.
bool covered(const Options& values, Frame request, Frame reply, std::size_t bit) {
  if (is_only_named(function_of(*reply.can))) return false;
  const bool fixed =
      request.can != nullptr && request.can->data[0] != command::read && request.can->data[0] != command::start;
  return fixed || bit >= to_format(values).bits;
}

// Nothing answers NMT, SYNC and emergencies, nor the command that enters the configuration.
bool answered(const Options&, Frame request) {
  const Function function = function_of(*request.can);
  if (function == Function::configuration) return request.can->data[0] != configuration::enter;
  return function == Function::command || function == Function::sdo_request;
}

LineSettings settings(const Options& values) { return {.rate = to_format(values).rate}; }

Explanation explain(const Options&, Error error, Frame request, Frame reply) {
  return explain_frame(error, request.can, reply.can);
}

}  // namespace
}  // namespace can

constinit const Unit can_unit{
    .id = "raa38-can",
    .name = "RAA38S6 on CAN",
    .document = "RAA38S6 manual, 3.4.1 CANopen",
    .link = LinkKind::can,
    .line = {.rate = 250'000},
    .options = can::options,
    .models = can::models,
    .fields = can::fields,
    .commands = can::commands,
    .vectors = can::vectors,
    .status = nullptr,
    .alarms = nullptr,
    .host_storage = std::max({sizeof(can::Read), sizeof(can::SetCyclic), sizeof(can::Zero), sizeof(can::SetDirection),
                              sizeof(can::Scan), sizeof(can::FindNode), sizeof(can::SetNode), sizeof(can::SetRate)}),
    .device_storage = sizeof(can::VirtualNode),
    .decode = can::decode_frame,
    .encode = can::encode,
    .delimit = can::delimit,
    .host = can::host,
    .device = can::device,
    .resolution = can::resolution,
    .covered = can::covered,
    .explain = can::explain,
    .settings = can::settings,
    .timing = {.turnaround_limit = can::answer_limit},
    .answered = can::answered,
};

}  // namespace absenc::raa38
