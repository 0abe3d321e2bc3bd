// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/unit.hpp"

#include <array>

#include "absenc/protocol/author/bits.hpp"
#include "absenc/protocol/author/look.hpp"
#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/raa38/can/device.hpp"
#include "absenc/protocol/raa38/can/host.hpp"
#include "absenc/protocol/raa38/can/vectors.hpp"

namespace absenc::raa38 {

namespace can {
namespace {

using author::field;
using author::option;
using author::with_role;

constexpr std::array<std::string_view, 3> rate_choices{"1000000", "500000", "250000"};
constexpr std::array<std::string_view, 2> answer_choices{"7e5", "7e4"};

constexpr auto options = author::OptionsOf{
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
// In CANopen, identifiers 201 to 27F are RPDO1, and those from 281 on TPDO2.
constexpr std::string_view survey_warning =
    "asks every number, by 201#8001 to 2FF#80FF: on a CANopen bus these are process data of other devices, which may "
    "obey them";
constexpr std::array<Argument, 1> cyclic_arguments{{{"readings", "a second", 1, 255}}};
constexpr std::array<Argument, 2> node_arguments{{{"node", "new number", 1, 255}, force}};
constexpr std::array<Argument, 2> rate_arguments{{{"rate", "1000000, 500000 or 250000", 1, 1'000'000}, force}};
constexpr std::array<Argument, 1> direction_arguments{{{"direction", "0: positive, 1: negative", 0, 1}}};

/// Returns the frame of a command's order, or invalid_argument.
template <Order order>
constexpr Result<CanFrame> to(const Format& format, Arguments arguments) {
  const auto value = value_of(format, order, arguments.empty() ? 0 : arguments[0]);
  if (!value) return Error::invalid_argument;
  return encode(order, format.node, *value);
}

// ---- Reported fields

constexpr auto fields = author::fields_of<Values>(
    field<&Values::node>("node", "", "number of the node", Role::encoder),
    field<&Values::function>("function", "", "meaning of the identifier in CANopen; this encoder does not use it",
                             Role::exchange),
    field<&Values::data>("data", "", "its data"),
    field<&Values::command>("command", "", "command that is requested or answered", Role::exchange),
    field<&Values::value>("value", "", "counting direction as command 22 carries it"),
    field<&Values::new_node>("new_node", "", "number that the node is given"),
    field<&Values::bit_rate>("bit_rate", "bit/s", "bit rate that the node is given"),
    field<&Values::clash>("clash", "", "two nodes share this number, or the line is bad", Role::clash),
    field<&Values::readings_per_s>("readings_per_s", "1/s", "positions that the node sends by itself"),
    field<&Values::singleturn>("singleturn", "counts", "position within one revolution", Role::position),
    field<&Values::angle>("angle_deg", "deg", "the same as an angle", Role::of_position),
    field<&Values::written>("written", "", "whether a value was written; it is not if it is set already",
                            Role::written),
    field<&Values::answered>("answered", "", "whether the command was answered"),
    field<&Values::mirrored>("mirrored", "", "whether the position is counted the other way since"),
    field<&Values::before>("before", "counts", "position before the command"),
    field<&Values::after>("after", "counts", "position after it"));

// Puts the fields of a decoded frame into `sink`, and its position, if it has one, as a reading.
constexpr void put_found(FieldSink& sink, const Format& format, const Values& found) {
  fields.put(sink, found);
  if (!found.singleturn) return;
  sink.put_reading(author::position_reading(static_cast<std::uint64_t>(*found.singleturn), format.bits));
}
void put_position(FieldSink& sink, const Format& format, const Reading& position) {
  fields.put(sink, values_of(format, format.node, position.singleturn));
}
void put_change(FieldSink& sink, const Format&, const Values& found) { fields.put(sink, found); }
void put_surveyed(FieldSink& sink, const Format&, const ConfigureResult& found) { fields.put(sink, found); }
void put_nodes(FieldSink& sink, const Format& format, const Nodes& found) {
  for (unsigned number = 1; number < found.at.size(); ++number) {
    const NodeFrames& node = found.at[number];
    if (!node.is_there()) continue;
    const bool shown = node.readable && !node.clash();
    Values values = shown ? values_of(format, 0, node.counts) : Values{};
    values.node = number;
    values.clash = node.clash();
    values.readings_per_s = node.per_second;
    put_found(sink, format, values);
  }
}
void put_left(FieldSink& sink, const Format&, const ConfigureResult& found) {
  if (found.written.value_or(false) && !found.verified) {
    fields.put(sink, {.node = found.node, .bit_rate = found.bit_rate});
  }
}

constexpr author::Report<Protocol> report{.explain = explain};
constexpr author::Finding<Format, Reading> position{.put = put_position};
constexpr author::Finding<Format, Values> found{.put = put_change};
constexpr author::Finding<Format, Nodes> nodes{.put = put_nodes};
constexpr author::Finding<Format, ConfigureResult> surveyed{.put = put_surveyed, .put_left = put_left};

// ---- Commands

constexpr bool listens(const Format& format) { return format.listens; }

template <Read::Mode mode>
constexpr author::CommandOf<Protocol> read_by(const Command& info) {
  using Made = author::Reported<report, Read, position>;
  return {.info = info,
          .request = [](const Format& format, Arguments) -> Result<CanFrame> { return position_request(format, mode); },
          .make = [](const Format& format, Arguments,
                     std::span<std::byte> storage) { return make_host<Made>(storage, format, mode); },
          .size = sizeof(Made)};
}

constexpr Command position_command{"position", Verb::read, 0, "position"};
constexpr auto commands = std::array{
    read_by<Read::Mode::ask>(position_command).or_when(listens, read_by<Read::Mode::listen>(position_command)),
    read_by<Read::Mode::listen>({"listen", Verb::read_part, 0, "the next position that the node sends by itself"}),
    read_by<Read::Mode::start>({"start", Verb::run, 0, "start the node", {}, true, false}),
    author::command<report, found, set_cyclic, to<Order::cyclic>>(
        {"cyclic", Verb::run, 0, "let the node send this many readings a second without requests", cyclic_arguments,
         true, false}),
    author::command<report, found, set_cyclic, to<Order::cyclic>>(
        {"stop", Verb::run, 0, "let it send none by itself", {}, true, false}),
    author::command<report, found, change, to<Order::zero>, Order::zero>(
        {"zero", Verb::zero, 0, "make this the zero of the turn", {}, true, false}),
    author::command<report, nodes, scan, to<Order::read>>(
        {"scan", Verb::scan, 0, "nodes on the bus", {}, false, false, {}, {}, survey_warning}),
    author::command<report, found, find_node, to<Order::read>>(
        {"node", Verb::config_get, 0, "number of the node", {}, false, false}),
    author::command<report, surveyed, configure, to<Order::node>, Order::node>(
        {"set-node", Verb::config_set, 0, "give the only node on the bus another number", node_arguments, true, false,
         "node", "node", survey_warning}),
    author::command<report, surveyed, configure, to<Order::rate>, Order::rate>(
        {"bitrate",
         Verb::config_set,
         0,
         "set the bit rate of the only node on the bus",
         rate_arguments,
         true,
         false,
         {},
         {},
         survey_warning}),
    author::command<report, found, change, to<Order::direction>, Order::direction>(
        {"direction", Verb::config_set, 0, "set the counting direction", direction_arguments, true, false}),
};

// ---- Declaration

constexpr auto models = std::array{author::ModelText{"RAA38S6", "one turn of 10 to 21 bits: option bits", 0, ""}};

constexpr LineSettings line_of(const Format& format) { return {.rate = format.bit_rate()}; }
constexpr Resolution resolution_of(const Format& format) { return {.singleturn_bits = format.bits}; }
constexpr Error decode_frames(const Format& format, Frame request, Frame reply, FieldSink& sink) {
  const Result<Values> values = can::decode(format, request.can, reply.can);
  if (values) put_found(sink, format, *values);
  return values.error();
}
// A CAN frame is always complete, because the controller delivers whole frames.
constexpr FrameEnd end_of_frame(const Options&, Direction, Bytes bytes) {
  return {FrameEnd::Kind::complete, bytes.size()};
}
// Returns whether decoding detects a wrong `bit` in the data of a reply; the CRC of CAN is not considered.
bool is_checked(const Options& values, Frame request, Frame reply, std::size_t bit) {
  if (is_only_named(function_of(*reply.can))) return false;
  const OrderInfo* const asked = request.can != nullptr ? order_of(*request.can) : &info_of(Order::read);
  return (asked != nullptr && asked->answer != Answer::position) || bit >= options.format(values).bits;
}
// Returns which data bits carry `field`; only the field of the position has any.
BitRanges bits_in(const Options& values, Frame, Frame, const FieldInfo& field) {
  if (&field != fields.of<&Values::singleturn>()) return {};
  return author::bits_of(0, 0, options.format(values).bits);
}
// Returns whether a node answers `request`.
bool awaits_answer(const Options&, Frame request) {
  const Function function = function_of(*request.can);
  if (function != Function::command && function != Function::configuration) return function == Function::sdo_request;
  const OrderInfo* const asked = order_of(*request.can);
  return asked == nullptr || asked->answer != Answer::none;
}

constexpr author::Declaration<Protocol, VirtualNode> declaration{
    .id = "raa38-can",
    .name = "RAA38S6 on CAN",
    .document = "Absolute Encoder Operation Manual, RAA38S6 series",
    .link = LinkKind::can,
    .options = options.infos,
    .format = author::format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .frames_are_texts = true,
    .frames_size = 1700,
    .report = report,
    .line = line_of,
    .resolution = resolution_of,
    .decode = decode_frames,
    .frame_end = end_of_frame,
    .is_answered = awaits_answer,
    .is_checked = is_checked,
    .bits = bits_in,
    .timing = {.turnaround_limit = answer_limit},
};

}  // namespace
}  // namespace can

constinit const Unit can_unit = author::Descriptor<can::declaration>::make();

}  // namespace absenc::raa38
