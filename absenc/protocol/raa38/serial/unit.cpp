// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/unit.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/author/bits.hpp"
#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/raa38/probe.hpp"
#include "absenc/protocol/raa38/serial/device.hpp"
#include "absenc/protocol/raa38/serial/host.hpp"
#include "absenc/protocol/raa38/serial/vectors.hpp"

namespace absenc::raa38 {

namespace serial {

namespace {

constexpr std::array<std::string_view, 3> mode_choices{"timing", "handshake", "bus"};
constexpr std::array<std::string_view, 3> second_byte_choices{"auto", "81", "echo"};
constexpr std::array<std::string_view, 3> zeroing_choices{"none", "line", "command"};
constexpr std::int64_t most_us = 10'000'000'000;  // greatest value of an option that is a time: 10 s, in nanoseconds

using author::decimal;
using author::option;
using author::probeable;
using author::with_role;

constexpr auto options = author::OptionsOf{
    option<&Format::mode>("mode", "what starts a frame: the encoder itself, a pulse on CLK, or BC AA Bx", mode_choices),
    probeable(option<&Format::bits>("bits", "of a turn", least_bits, most_bits)),
    with_role<Role::encoder>(
        option<&Format::unit>("unit", "bus: the encoder's number, the x of Bx", 0, unit_count - 1)),
    probeable(option<&Format::second_byte>("second_byte", "of a frame: 81, or on a bus the number (echo)",
                                           second_byte_choices)),
    option<&Format::zeroing>("zeroing", "how its zero is set: a pulse on CLR (line), or BC AA Cx on a bus (command)",
                             zeroing_choices),
    option<&Format::zero_unit>("zero_unit", "the x of Cx; -1: that of Bx", -1, unit_count - 1),
    decimal<3>(option<&Format::refresh_millihertz>(
        "refresh_hz", "timing: frames a second; 0: not known (the virtual encoder: 100)", 0, 100'000'000)),
    decimal<3>(option<&Format::acquisition>(
        "acquisition_us", "T3, from pulse or request to the frame, us; 0: not known (the virtual encoder: 100)", 0,
        most_us)),
    decimal<3>(option<&Format::transmission>(
        "transmission_us", "T1 - T3, how long a frame takes, us; 0: as long as its characters", 0, most_us)),
};
constexpr std::size_t bits_option = options.find("bits");
constexpr std::size_t second_byte_option = options.find("second_byte");

// ---- End of a frame

FrameEnd frame_end(const Options& values, Direction direction, Bytes bytes) {
  const Format format = options.format(values);
  const bool is_request = direction == Direction::request;
  const std::size_t size = is_request ? request_bytes : format.frame_bytes();
  if (!bytes.empty() && bytes[0] != (is_request ? encode_request({})[0] : header)) return {FrameEnd::Kind::no_frame};
  if (bytes.size() < size) return {FrameEnd::Kind::incomplete, size};
  const bool good = is_request ? decode_request(bytes.first(size)).has_value()
                               : decode_position(format, bytes.first(size)).has_value();
  return good ? FrameEnd{FrameEnd::Kind::complete, size} : FrameEnd{FrameEnd::Kind::no_frame};
}

// ---- Evidence of captured frames for bits and second_byte

std::string_view bits_contradiction(std::int64_t bits, Bytes reply) {
  if (reply.empty()) return {};
  const Error error = decode_position({.bits = static_cast<unsigned>(bits)}, reply).error();
  if (error == Error::wrong_length) return "it has another number of data bytes";
  return error == Error::out_of_range ? "its position has more bits" : "";
}

int unit_of(const Capture& capture) {
  const Result<Request> asked = decode_request(capture.request);
  return asked ? asked->unit : any_unit;
}

std::string_view second_byte_contradiction(SecondByte form, const Capture& capture) {
  const Bytes reply = capture.reply;
  if (reply.size() < 2 || second_byte_fits({.second_byte = form}, unit_of(capture), reply[1])) return {};
  return form == SecondByte::fixed ? "its second byte is not 81" : "its second byte is not the number";
}

bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  constexpr std::string_view fits = "every frame fits";
  judge_option(sink, bits_option, least_bits, most_bits, captures.size(), values.values[bits_option], fits,
               [&](std::int64_t bits, std::size_t i) { return bits_contradiction(bits, captures[i].reply); });
  judge_option(sink, second_byte_option, 0, second_byte_choices.size() - 1, captures.size(),
               values.values[second_byte_option], fits, [&](std::int64_t form, std::size_t i) {
                 return second_byte_contradiction(static_cast<SecondByte>(form), captures[i]);
               });
  const Format format = options.format(values);
  return std::all_of(captures.begin(), captures.end(), [&](const Capture& capture) {
    return capture.reply.empty() || decode_position(format, capture.reply, unit_of(capture)).has_value();
  });
}

// ---- Reported fields

constexpr Values values_of_request(const Format&, const Request& request) {
  return {.command = request.kind == Request::Kind::read ? "read" : "zero_clear", .unit = request.unit};
}
constexpr Values values_of_reply(const Format& format, const Request&, const Position& reply) {
  return values_of(format, reply);
}
void put_found(FieldSink& sink, const Format& format, const Values& found) {
  fields.put(sink, found);
  if (found.singleturn) sink.put_reading(author::position_reading(*found.singleturn, format.bits));
}
void put_units(FieldSink& sink, const Format& format, const Units& found) {
  for (const Values& unit : found) {
    if (unit.encoder_address) put_found(sink, format, unit);
  }
}

constexpr author::Report<Protocol> report{
    .put_request = author::put_values<fields, values_of_request>,
    .put_reply = author::put_values<fields, values_of_reply>,
    .explain = explain,
};
constexpr author::Finding<Format, Values> found{.put = put_found};
constexpr author::Finding<Format, Units> units{.put = put_units};

// ---- Commands

constexpr bool listens(const Format& format) { return format.mode == Mode::timing; }

constexpr Request to_scan(const Format&, Arguments) { return {}; }
constexpr Request to_zero(const Format& format, Arguments) {
  return {format.zeroing == Zeroing::line ? Request::Kind::clear : Request::Kind::zero_clear, format.zeroed_unit()};
}

Any<Conversation> make_listen(const Format& format, Arguments, std::span<std::byte> storage) {
  return make_host<Listen>(storage, format);
}

constexpr Command position{"position", Verb::read, 0, "position within the turn"};
constexpr auto commands = std::array{
    author::reading<report, position_request, ReadPosition>(position).or_when(
        listens, {.info = position, .request = nullptr, .make = make_listen, .size = sizeof(Listen)}),
    author::command<report, units, scan, to_scan>(
        {"scan", Verb::scan, 0, "units that answer on a bus", {}, false, false}),
    author::command<report, found, set_zero, to_zero>(
        {"zero", Verb::zero, 0, "make this the zero of the turn", {}, true, false}),
};

// ---- Declaration

// The model states no highest speed of the shaft, because the document gives none.
constexpr auto models =
    std::array{author::ModelText{"RAA38S6", "10 to 21 bits, single-turn; by itself, by pulse, on a bus", 0, ""}};

BitRanges bits_in(const Options& values, Frame, Frame, const FieldInfo& field) {
  const Format format = options.format(values);
  if (&field == fields.of<&Values::second_byte>()) return author::bits_of(1, 0, 8);
  if (&field != fields.of<&Values::singleturn>()) return {};
  return author::big_endian_bits(2, format.data_bytes(), format.bits);
}
// Returns baud rate 0, that is none: the document gives no baud rate, so the user must set it.
constexpr LineSettings line_of(const Format&) { return {.rate = 0}; }
constexpr Resolution resolution_of(const Format& format) { return {format.bits, 0}; }
constexpr Result<Request> guess_request(const Format&, Bytes) { return Request{Request::Kind::trigger}; }
// Returns whether frames come without a request in bytes; a pulse on CLK counts as no request.
bool is_streaming(const Options& values) { return options.format(values).mode != Mode::bus; }
bool is_answered(const Options&, Frame request) {
  const Result<Request> asked = decode_request(request.bytes);
  return asked && asked->kind == Request::Kind::read;
}
ExtraWires wires_of(const Options& values) {
  const Format format = options.format(values);
  return {.trigger = format.mode == Mode::handshake, .clear = format.zeroing == Zeroing::line};
}

constexpr author::Declaration<Protocol, VirtualEncoder> declaration{
    .id = "raa38",
    .name = "RAA38S6, RS-485, RS-232 or RS-422",
    .document = "Absolute Encoder Operation Manual, RAA38S6 series",
    .link = LinkKind::half_duplex,  // of RS-485, RS-232 and RS-422, RS-485 restricts the host most
    .options = options.infos,
    .format = author::format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .frames_size = 1000,
    .report = report,
    .line = line_of,
    .resolution = resolution_of,
    .guess_request = guess_request,
    .frame_end = frame_end,
    .is_answered = is_answered,
    .bits = bits_in,
    .probe = probe,
    .streams = is_streaming,
    .extra_wires = wires_of,
    .timing = {.turnaround_limit = answer_limit},
};

}  // namespace
}  // namespace serial

constinit const Unit serial_unit = author::Descriptor<serial::declaration>::make();

}  // namespace absenc::raa38
