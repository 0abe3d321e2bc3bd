// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/unit.hpp"

#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/raa38/can/device.hpp"
#include "absenc/protocol/raa38/can/explain.hpp"
#include "absenc/protocol/raa38/can/fields.hpp"
#include "absenc/protocol/raa38/can/procedures.hpp"
#include "absenc/protocol/raa38/can/vectors.hpp"

namespace absenc::raa38 {

namespace can {
namespace {

using author::option;
using author::with_role;

constexpr std::array<std::string_view, 3> rate_choices{"1000000", "500000", "250000"};
constexpr std::array<std::string_view, 2> answer_choices{"7e5", "7e4"};

constexpr author::OptionsOf options{
    option<&Format::bits>("bits", "of the position", 10, 21),
    with_role<Role::encoder>(option<&Format::node>("node", "number of the encoder on the bus", 1, 255)),
    with_role<Role::rate>(option<&Format::rate>("bitrate", "bits a second on the bus", rate_choices)),
    option<&Format::listens>("listen", "read what the node sends by itself instead of asking for it"),
    option<&Format::positive>("positive_value", "what command 22 carries to count up; the document does not say", 0,
                              255),
    option<&Format::negative>("negative_value", "what command 22 carries to count down", 0, 255),
    option<&Format::cyclic>("cyclic", "virtual encoder: readings a second that it sends unasked after power on", 0,
                            255),
    option<&Format::answers_on_7e4>(
        "answer_id", "virtual encoder: identifier on which it answers configuration commands", answer_choices),
};

constexpr Argument force{"force", "1: write even what is set already", 0, 1, 0, false, Role::force};
constexpr std::array<Argument, 1> cyclic_arguments{{{"readings", "a second", 1, 255}}};
constexpr std::array<Argument, 2> node_arguments{{{"node", "new number", 1, 255}, force}};
constexpr std::array<Argument, 2> rate_arguments{{{"rate", "1000000, 500000 or 250000", 1, 1'000'000}, force}};
constexpr std::array<Argument, 1> direction_arguments{{{"direction", "0: positive, 1: negative", 0, 1}}};

// ---- The one frame that does the command's work

constexpr CanFrame to_read(const Format& format, Arguments) { return encode_command(format.node, command::read); }
constexpr CanFrame to_zero(const Format& format, Arguments) { return encode_command(format.node, command::zero); }
constexpr CanFrame to_set_cyclic(const Format& format, Arguments arguments) {
  const std::int64_t readings = arguments.empty() ? 0 : arguments[0];
  return encode_command(format.node, command::cyclic, static_cast<std::uint8_t>(readings));
}
constexpr CanFrame to_set_direction(const Format& format, Arguments arguments) {
  return encode_command(format.node, command::direction, arguments[0] == 0 ? format.positive : format.negative);
}
constexpr CanFrame to_set_node(const Format&, Arguments arguments) {
  return encode_configuration(configuration::node, static_cast<std::uint8_t>(arguments[0]));
}
constexpr Result<CanFrame> to_set_rate(const Format&, Arguments arguments) {
  const Rate* const rate = rate_of_bits(arguments[0]);
  if (rate == nullptr) return Error::invalid_argument;
  return encode_configuration(configuration::rate, 0, rate->index);
}

// The CRC of CAN is the controller's: here only what must be as it is.
bool covered(const Options& values, Frame request, Frame reply, std::size_t bit) {
  if (is_only_named(function_of(*reply.can))) return false;
  const bool fixed =
      request.can != nullptr && request.can->data[0] != command::read && request.can->data[0] != command::start;
  return fixed || bit >= options.format(values).bits;
}

// Nothing answers NMT, SYNC and emergencies, nor the command that enters the configuration.
bool answered(const Options&, Frame request) {
  const Function function = function_of(*request.can);
  if (function == Function::configuration) return request.can->data[0] != configuration::enter;
  return function == Function::command || function == Function::sdo_request;
}

// ---- What is declared

constexpr bool listens(const Format& format) { return format.listens; }

template <class Definition, Read::Way way>
constexpr author::CommandOf<Protocol> read_by(const Command& info) {
  using Made = author::Told<Definition, Read>;
  return {.info = info,
          .request = [](const Format& format, Arguments) -> Result<CanFrame> { return position_request(format, way); },
          .make = [](const Format& format, Arguments,
                     std::span<std::byte> storage) { return make_host<Made>(storage, format, way); },
          .size = sizeof(Made)};
}

struct Fields {
  std::span<const FieldInfo> infos;
};

struct SetNode : Configured {};
struct SetRate : Configured {};
struct SetZero : Changed {};
struct SetDirection : Changed {};

struct Definition {
  using Protocol = can::Protocol;
  using Encoder = VirtualNode;
  static constexpr std::string_view id = "raa38-can", name = "RAA38S6 on CAN",
                                    document = "RAA38S6 manual, 3.4.1 CANopen";
  static constexpr LinkKind link = LinkKind::can;
  static constexpr std::size_t frames_size = 1700;
  static constexpr auto options = can::options;
  static constexpr Fields fields{can::fields};
  static constexpr auto vectors = can::vectors;
  static constexpr auto covered = can::covered;
  static constexpr auto answered = can::answered;
  static constexpr LineTiming timing{.turnaround_limit = answer_limit};
  static constexpr std::array models{author::ModelText{"RAA38S6", "one turn of 10 to 21 bits: option bits", 0, ""}};

  static constexpr Command position{"position", Verb::read, 0, "position"};
  static constexpr std::array commands{
      read_by<Definition, Read::Way::ask>(position).or_when(listens, read_by<Definition, Read::Way::listen>(position)),
      read_by<Definition, Read::Way::listen>(
          {"listen", Verb::read_part, 0, "the next position that the node sends by itself"}),
      read_by<Definition, Read::Way::start>({"start", Verb::run, 0, "start the node", {}, true, false}),
      author::command<Definition, Protocol, Cyclic, set_cyclic, to_set_cyclic>(
          {"cyclic", Verb::run, 0, "let the node send so many readings a second by itself", cyclic_arguments, true,
           false}),
      author::command<Definition, Protocol, Cyclic, set_cyclic, to_set_cyclic>(
          {"stop", Verb::run, 0, "let it send none by itself", {}, true, false}),
      author::command<Definition, Protocol, SetZero, set_zero, to_zero>(
          {"zero", Verb::zero, 0, "make this the zero of the turn", {}, true, false}),
      author::command<Definition, Protocol, Nodes, scan, to_read>(
          {"scan", Verb::scan, 0, "who is on the bus", {}, false, false}),
      author::command<Definition, Protocol, OneNode, find_node, to_read>(
          {"node", Verb::config_get, 0, "number of the node", {}, false, false}),
      author::command<Definition, Protocol, SetNode, set_node, to_set_node>(
          {"set-node", Verb::config_set, 0, "give the only node on the bus another number", node_arguments, true, false,
           "node"}),
      author::command<Definition, Protocol, SetRate, set_rate, to_set_rate>(
          {"bitrate", Verb::config_set, 0, "set the bit rate of the only node on the bus", rate_arguments, true,
           false}),
      author::command<Definition, Protocol, SetDirection, set_direction, to_set_direction>(
          {"direction", Verb::config_set, 0, "set the counting direction", direction_arguments, true, false}),
  };

  static constexpr LineSettings line(const Format& format) { return {.rate = format.bit_rate()}; }
  static constexpr Resolution resolution(const Format& format) { return {.singleturn_bits = format.bits}; }
  static constexpr Error decode(const Format& format, Frame request, Frame reply, FieldSink& sink) {
    return can::decode(format, request.can, reply.can, sink);
  }
  // The controller of the bus does it.
  static constexpr Delimit delimit(const Options&, Direction, Bytes bytes) {
    return {Delimit::Kind::complete, bytes.size()};
  }
  static Explanation explain(const Format&, Error error, std::span<const CanFrame> request,
                             std::span<const CanFrame> reply) {
    return explain_frame(error, request.empty() ? nullptr : request.data(), reply.empty() ? nullptr : reply.data());
  }

  static void put(FieldSink& sink, const Format& format, const Reading& found) {
    can::put(sink, field_node, format.node);
    put_position(sink, format, static_cast<std::uint32_t>(found.singleturn));
  }
  static void put(FieldSink& sink, const Format& format, const Cyclic& found) {
    can::put(sink, field_node, format.node);
    can::put(sink, field_readings_per_s, found.readings_per_s);
    can::put(sink, field_answered, found.answered ? 1 : 0);
  }
  static void put(FieldSink& sink, const Format& format, const SetZero& found) {
    can::put(sink, field_node, format.node);
    can::put(sink, field_written, found.written ? 1 : 0);
    if (found.written) can::put(sink, field_answered, found.answered ? 1 : 0);
    can::put(sink, field_before, found.before);
    can::put(sink, field_after, found.after);
  }
  static void put(FieldSink& sink, const Format& format, const SetDirection& found) {
    can::put(sink, field_node, format.node);
    can::put(sink, field_value, found.value);
    can::put(sink, field_answered, found.answered ? 1 : 0);
    can::put(sink, field_mirrored, found.mirrored ? 1 : 0);
    can::put(sink, field_before, found.before);
    can::put(sink, field_after, found.after);
  }
  static void put(FieldSink& sink, const Format& format, const Nodes& found) {
    for (unsigned number = 1; number < found.at.size(); ++number) {
      const Heard& node = found.at[number];
      if (!node.is_there()) continue;
      can::put(sink, field_node, number);
      can::put(sink, field_clash, node.clash() ? 1 : 0);
      can::put(sink, field_readings_per_s, node.per_second);
      if (node.readable && !node.clash()) put_position(sink, format, node.counts);
    }
  }
  static void put(FieldSink& sink, const Format&, const OneNode& found) { can::put(sink, field_node, found.node); }
  static void put(FieldSink& sink, const Format&, const SetNode& found) { put_configured(sink, field_node, found); }
  static void put(FieldSink& sink, const Format&, const SetRate& found) { put_configured(sink, field_bit_rate, found); }
  static void put_configured(FieldSink& sink, FieldIndex field, const Configured& found) {
    can::put(sink, field, found.value);
    can::put(sink, field_written, found.written ? 1 : 0);
    if (found.written) can::put(sink, field_answered, found.answered ? 1 : 0);
  }
  static void put_left(FieldSink& sink, const Format&, const SetNode& found) { put_left(sink, field_node, found); }
  static void put_left(FieldSink& sink, const Format&, const SetRate& found) { put_left(sink, field_bit_rate, found); }
  static void put_left(FieldSink& sink, FieldIndex field, const Configured& found) {
    if (found.written && !found.verified) can::put(sink, field, found.value);
  }
};

}  // namespace
}  // namespace can

constinit const Unit can_unit = author::UnitOf<can::Definition>::make();

}  // namespace absenc::raa38
