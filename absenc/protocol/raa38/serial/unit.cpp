// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/unit.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/make.hpp"
#include "absenc/protocol/raa38/serial/device.hpp"
#include "absenc/protocol/raa38/serial/fields.hpp"
#include "absenc/protocol/raa38/serial/host.hpp"
#include "absenc/protocol/raa38/serial/listen.hpp"
#include "absenc/protocol/raa38/serial/vectors.hpp"
#include "absenc/protocol/raa38/unit.hpp"

namespace absenc::raa38 {

namespace serial {

namespace {

constexpr std::array<std::string_view, 3> mode_choices{"timing", "handshake", "bus"};
constexpr std::array<std::string_view, 3> second_byte_choices{"auto", "81", "echo"};
constexpr std::array<std::string_view, 3> zeroing_choices{"none", "line", "command"};
constexpr std::int64_t most_us = 10'000'000'000;  // ns: 10 s

constexpr std::array<Option, 10> options{{
    {.name = "mode",
     .meaning = "what starts a frame: the encoder itself, a pulse on CLK, or BC AA Bx",
     .default_value = 0,
     .choices = mode_choices},
    {.name = "bits",
     .meaning = "of a turn; the encoders have 10 to 21",
     .default_value = 14,
     .minimum = least_bits,
     .maximum = most_bits,
     .probeable = true},
    {.name = "unit",
     .meaning = "bus: the encoder's number, the x of Bx",
     .default_value = 1,
     .minimum = 0,
     .maximum = unit_count - 1},
    {.name = "second_byte",
     .meaning = "of a frame: 81, or on a bus the number (echo)",
     .default_value = 0,
     .choices = second_byte_choices,
     .probeable = true},
    {.name = "zeroing",
     .meaning = "how its zero is set: a pulse on CLR (line), or BC AA Cx on a bus (command)",
     .default_value = 0,
     .choices = zeroing_choices},
    {.name = "zero_unit",
     .meaning = "the x of Cx; -1: that of Bx",
     .default_value = -1,
     .minimum = -1,
     .maximum = unit_count - 1},
    {.name = "refresh_hz",
     .meaning = "timing: frames a second; 0: not known (the virtual encoder: 100)",
     .default_value = 0,
     .minimum = 0,
     .maximum = 100'000'000,
     .decimals = 3},
    {.name = "max_rpm",
     .meaning = "refuse positions that a shaft so fast cannot reach; 0: none; timing: needs refresh_hz",
     .default_value = 0,
     .minimum = 0,
     .maximum = 1'000'000},
    {.name = "acquisition_us",
     .meaning = "T3, from pulse or request to the frame, us; 0: not known (the virtual encoder: 100)",
     .default_value = 0,
     .minimum = 0,
     .maximum = most_us,
     .decimals = 3},
    {.name = "transmission_us",
     .meaning = "T1 - T3, how long a frame takes, us; 0: as long as its characters",
     .default_value = 0,
     .minimum = 0,
     .maximum = most_us,
     .decimals = 3},
}};

// The document names no speed.
constexpr std::array<Model, 1> models{
    {{"RAA38S6", "10 to 21 bits, single-turn; by itself, by pulse, on a bus", 0, {}}}};

constexpr std::array<Command, 3> commands{{
    {"position", Verb::read, number_mark, "position within the turn"},
    {"scan", Verb::scan, number_mark, "who answers on a bus", {}, false, false},
    {"zero", Verb::zero, clear_mark, "make this the zero of the turn", {}, true, false},
}};

Error decode_frame(const Options& values, Frame request, Frame reply, FieldSink& sink) {
  return decode(to_settings(values).format, request.bytes, reply.bytes, sink);
}

// Frames of the other modes are started by no byte.
Result<std::size_t> encode(const Options& values, const Command& command, Arguments, MutableBytes request) {
  const Settings settings = to_settings(values);
  RequestBytes bytes;
  if (command.verb == Verb::zero) {
    if (settings.zeroing == Zeroing::line) return Error::unsupported;
    bytes = encode_request({Request::Kind::zero_clear, settings.zero_unit});
  } else {
    if (settings.mode != Mode::bus) return Error::unsupported;
    bytes = encode_request({Request::Kind::read, command.verb == Verb::scan ? std::uint8_t{0} : settings.unit});
  }
  if (request.size() < bytes.size()) return Error::buffer_too_small;
  std::copy_n(bytes.view().begin(), bytes.size(), request.begin());
  return bytes.size();
}

Delimit delimit(const Options& values, Direction direction, Bytes bytes) {
  const Format format = to_settings(values).format;
  const bool asks = direction == Direction::request;
  const std::size_t size = asks ? request_bytes : format.frame_bytes();
  if (!bytes.empty() && bytes[0] != (asks ? encode_request({})[0] : header)) return {Delimit::Kind::no_frame};
  if (bytes.size() < size) return {Delimit::Kind::incomplete, size};
  const bool good =
      asks ? decode_request(bytes.first(size)).has_value() : decode_position(format, bytes.first(size)).has_value();
  return good ? Delimit{Delimit::Kind::complete, size} : Delimit{Delimit::Kind::no_frame};
}

Any<Conversation> host(const Options& values, const Command& command, Arguments, std::span<std::byte> storage) {
  const Settings settings = to_settings(values);
  switch (command.verb) {
    case Verb::read:
      if (settings.mode == Mode::timing) return make_host<Listen>(storage, settings);
      return make_host<ReadPosition>(storage, settings);
    case Verb::scan:
      return make_host<Scan>(storage, settings);
    case Verb::zero:
      return make_host<Zero>(storage, settings);
    default:
      return {};
  }
}

Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
  return make_device<VirtualEncoder>(storage, to_settings(values), shaft);
}

Resolution resolution(const Options& values) { return {to_settings(values).format.bits, 0}; }

// A pulse is no byte either.
bool streams(const Options& values) { return to_settings(values).mode != Mode::bus; }

bool answered(const Options&, Frame request) {
  const Result<Request> asked = decode_request(request.bytes);
  return asked && asked->kind == Request::Kind::read;
}

ExtraLines extra_lines(const Options& values) {
  const Settings settings = to_settings(values);
  return {.trigger = settings.mode == Mode::handshake, .clear = settings.zeroing == Zeroing::line};
}

Explanation explain(const Options&, Error error, Frame request, Frame reply) {
  switch (error) {
    case Error::wrong_length:
      if (reply.empty()) return {"a request has three bytes: BC AA Bx or BC AA Cx", {}};
      return {"up to 16 bits make two data bytes, up to 24 three, more make four", "check bits"};
    case Error::out_of_range:
      return {"the position has more bits than the option bits says", "set bits"};
    case Error::unexpected_reply:
      if (reply.empty()) return {"a request is BC AA Bx or BC AA Cx", {}};
      if (!request.empty()) return {"nothing answers BC AA Cx; FF 81 or FF Bx answers BC AA Bx, with the same x", {}};
      return {"a frame begins with FF 81, on a bus also with FF Bx", "check second_byte"};
    default:
      return {};
  }
}

// ---- What captured frames say of bits and second_byte

constexpr std::string_view nothing_against = "every frame fits";

OptionEvidence bits_evidence(unsigned bits, std::span<const Capture> captures) {
  OptionEvidence evidence{option_bits, bits, true, 0, nothing_against};
  const Format format{.bits = bits};
  for (std::size_t i = 0; i < captures.size() && evidence.possible; ++i) {
    const Bytes reply = captures[i].reply;
    if (reply.empty()) continue;
    const Error error = decode_position(format, reply).error();
    if (error != Error::wrong_length && error != Error::out_of_range) continue;
    evidence.possible = false;
    evidence.capture = i;
    evidence.why = error == Error::wrong_length ? "it has another number of data bytes" : "its position has more bits";
  }
  return evidence;
}

OptionEvidence second_byte_evidence(SecondByte form, std::span<const Capture> captures) {
  OptionEvidence evidence{option_second_byte, static_cast<std::int64_t>(form), true, 0, nothing_against};
  for (std::size_t i = 0; i < captures.size() && evidence.possible; ++i) {
    const Result<Request> asked = decode_request(captures[i].request);
    const Bytes reply = captures[i].reply;
    const int unit = asked ? asked->unit : anybody;
    if (reply.size() < 2 || second_byte_fits({.second_byte = form}, unit, reply[1])) continue;
    evidence.possible = false;
    evidence.capture = i;
    evidence.why = form == SecondByte::fixed ? "its second byte is not 81" : "its second byte is not the number";
  }
  return evidence;
}

// The position of a shaft that was not turned has as many bits as it likes: the fewest possible is no proof, so that
// the default stays where it fits.
bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  const auto settle = [&](std::size_t option, std::int64_t value, bool& any, const OptionEvidence& evidence) {
    sink.put(evidence);
    if (!evidence.possible) return;
    if (!any || value == options[option].default_value) values.values[option] = value;
    any = true;
  };
  bool any_bits = false;
  for (unsigned bits = least_bits; bits <= most_bits; ++bits) {
    settle(option_bits, bits, any_bits, bits_evidence(bits, captures));
  }
  bool any_form = false;
  for (std::size_t form = 0; form < second_byte_choices.size(); ++form) {
    settle(option_second_byte, static_cast<std::int64_t>(form), any_form,
           second_byte_evidence(static_cast<SecondByte>(form), captures));
  }
  if (!any_bits || !any_form) return false;
  const Format format = to_settings(values).format;
  return std::all_of(captures.begin(), captures.end(), [&](const Capture& capture) {
    const Result<Request> asked = decode_request(capture.request);
    return capture.reply.empty() || decode_position(format, capture.reply, asked ? asked->unit : anybody).has_value();
  });
}

}  // namespace

Settings to_settings(const Options& options_of_unit) {
  const auto microseconds = [&](std::size_t option) { return Time(options_of_unit[option]); };  // 3 decimals: ns
  Settings settings;
  settings.format.bits = static_cast<unsigned>(options_of_unit[option_bits]);
  settings.format.second_byte = static_cast<SecondByte>(options_of_unit[option_second_byte]);
  settings.mode = static_cast<Mode>(options_of_unit[option_mode]);
  settings.unit = static_cast<std::uint8_t>(options_of_unit[option_unit]);
  settings.zeroing = static_cast<Zeroing>(options_of_unit[option_zeroing]);
  const std::int64_t zero_unit = options_of_unit[option_zero_unit];
  settings.zero_unit = zero_unit < 0 ? settings.unit : static_cast<std::uint8_t>(zero_unit);
  const std::int64_t millihertz = options_of_unit[option_refresh_hz];
  if (millihertz > 0) settings.period = Time(1'000'000'000'000 / millihertz);
  settings.maximum_rpm = static_cast<std::uint32_t>(options_of_unit[option_max_rpm]);
  settings.acquisition = microseconds(option_acquisition_us);
  settings.transmission = microseconds(option_transmission_us);
  return settings;
}

}  // namespace serial

constinit const Unit serial_unit{
    .id = "raa38",
    .name = "RAA38S6, RS-485, RS-232 or RS-422",
    .document = "Absolute Encoder Operation Manual, RAA38S6 series",
    .link = LinkKind::half_duplex,  // of three kinds of line the one that allows least
    .line = serial::line_settings,
    .options = serial::options,
    .models = serial::models,
    .fields = serial::fields,
    .commands = serial::commands,
    .vectors = serial::vectors,
    .status = nullptr,
    .alarms = nullptr,
    .host_storage =
        std::max({sizeof(serial::Listen), sizeof(serial::ReadPosition), sizeof(serial::Zero), sizeof(serial::Scan)}),
    .device_storage = sizeof(serial::VirtualEncoder),
    .decode = serial::decode_frame,
    .encode = serial::encode,
    .delimit = serial::delimit,
    .host = serial::host,
    .device = serial::device,
    .resolution = serial::resolution,
    .explain = serial::explain,
    .probe = serial::probe,
    .extra_lines = serial::extra_lines,
    .timing = {.turnaround_limit = serial::answer_limit},
    .streams = serial::streams,
    .answered = serial::answered,
};

}  // namespace absenc::raa38
