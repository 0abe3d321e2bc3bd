// SPDX-License-Identifier: Apache-2.0
// The commands of HIPERFACE encoders, and the declaration of the unit.
#include "absenc/protocol/hiperface/unit.hpp"

#include <array>
#include <optional>

#include "absenc/protocol/author/scan.hpp"
#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/hiperface/alarm_follower.hpp"
#include "absenc/protocol/hiperface/device.hpp"
#include "absenc/protocol/hiperface/fields.hpp"
#include "absenc/protocol/hiperface/procedures.hpp"
#include "absenc/protocol/hiperface/vectors.hpp"

namespace absenc::hiperface {

namespace {

using namespace author;

// ---- Reports

constexpr Values values_of_request(const Format&, const Request& request) { return values_of(request); }
constexpr void put_reply(FieldSink& sink, const Format& format, const Request& request, const Reply& reply) {
  fields.put(sink, values_of(format, request, reply));
}
constexpr void put_found(FieldSink& sink, const Format&, const ProcedureResult& found) { fields.put(sink, found); }

constexpr std::size_t addresses = last_address - first_address + 1;
void put_nodes(FieldSink& sink, const Format&, const Nodes<addresses>& nodes) {
  for (std::size_t i = 0; i < addresses; ++i) {
    if (!nodes.there[i]) continue;
    fields.put(sink, {.encoder_address = static_cast<std::uint8_t>(first_address + i), .clash = nodes.clash[i]});
  }
}

// Returns the resolution that a type label or a description reports; 0 and 0 if the reply reports none.
Resolution reported(Bytes reply) {
  const auto code = static_cast<CommandCode>(reply[1] & ~error_bit);
  if (code == CommandCode::type_label && reply.size() == shortest_frame + 4) return resolution_of_type(reply[3]);
  const bool is_description = code == CommandCode::read_data && reply.size() == shortest_frame + 3 + description_size &&
                              reply[2] == description_field && reply[3] == 0;
  return is_description ? resolution_in(reply.subspan(5, description_size)) : Resolution{};
}

// Returns cause and advice for an error; both may be empty. The cause of a refusal is its status code in words.
Explanation explain(const Format& format, Error error, Bytes request, Bytes reply) {
  if (error == Error::request_rejected && reply.size() == shortest_frame + format.status_bytes) {
    const std::uint8_t code = reply[reply.size() - 2];
    if (code == refusal::access_code) return {text_of_status(code), "set the options code0 and access_code"};
    if (code == refusal::parity || code == refusal::checksum || code == refusal::length) {
      return {text_of_status(code), "send the same request again; if it stays, check termination and shielding"};
    }
    return {text_of_status(code)};
  }
  const auto of = [&](CommandCode command) {
    return reply.size() > 1 && (reply[1] & ~error_bit) == static_cast<unsigned>(command);
  };
  if (error == Error::unexpected_reply && (of(CommandCode::type_label) || of(CommandCode::read_data)) &&
      format.contradicts(reported(reply))) {
    return {"the encoder reports another resolution than the options",
            "set its model, or the options singleturn_bits and multiturn_bits; a host without them asks the encoder"};
  }
  if (error != Error::wrong_length || request.size() < 2) return {};
  switch (static_cast<CommandCode>(request[1])) {
    case CommandCode::status:
      return {"the status may have another length", "set the option status_bytes"};
    case CommandCode::counter:
      return {"the counter may have another length", "set the option counter_bytes"};
    case CommandCode::free_memory:
      return {"the free memory may have another length", "set the option free_bytes"};
    case CommandCode::serial_number:
      return {"the texts may have other lengths", "set the options serial_bytes and version_bytes"};
    default:
      return {};
  }
}

constexpr Report<Protocol> report{
    .put_request = put_values<fields, values_of_request>,
    .put_reply = put_reply,
    .explain = explain,
};
constexpr Finding<Format, ProcedureResult> found{.put = put_found};
constexpr Finding<Format, Nodes<addresses>> nodes{.put = put_nodes};

// ---- Requests: each is the main request of a command; procedures send more

template <CommandCode command>
constexpr Request plain(const Format& format, Arguments = {}) {
  return plain_request(format, command);
}
// Returns a request of `command` whose byte behind the command code is the first argument, or `subject` if there are no
// arguments.
template <CommandCode command, std::uint8_t subject = 0>
constexpr Request about(const Format& format, Arguments arguments) {
  Request request = plain_request(format, command);
  request.subject = arguments.empty() ? subject : byte(arguments[0]);
  request.code = command == CommandCode::set_address ? format.code0 : std::uint8_t{0};
  return request;
}
constexpr Request label_to_all() {
  return {.command = CommandCode::type_label, .address = broadcast_address, .any_resolution = true};
}
constexpr Request label_of_all(const Format&, Arguments) { return label_to_all(); }
constexpr Request label_at(std::size_t node) {
  return {.command = CommandCode::type_label,
          .address = static_cast<std::uint8_t>(first_address + node),
          .any_resolution = true};
}
constexpr Result<Request> to_set_position(const Format& format, Arguments arguments) {
  Request request = plain_request(format, CommandCode::set_position);
  if (!arguments.empty() && arguments[0] >> format.position_bits() != 0) return Error::invalid_argument;
  request.position = arguments.empty() ? 0 : static_cast<std::uint32_t>(arguments[0]);
  request.code = format.code0;
  return request;
}
constexpr Request to_clear_counter(const Format& format, Arguments) {
  Request request = plain_request(format, CommandCode::clear_counter);
  request.code = format.code0;
  return request;
}
constexpr Request to_read(const Format& format, Arguments arguments) {
  return {.command = CommandCode::read_data,
          .address = format.address,
          .subject = byte(arguments[1]),
          .first = byte(arguments[0]),
          .count = byte(arguments[2]),
          .code = format.access_code};
}
constexpr Request to_write(const Format& format, Arguments arguments) {
  Request request{.command = CommandCode::store_data,
                  .address = format.address,
                  .subject = byte(arguments[2]),
                  .first = byte(arguments[0]),
                  .count = 1,
                  .code = format.access_code};
  request.data.push_back(byte(arguments[1]));
  return request;
}
constexpr Result<Request> to_create(const Format& format, Arguments arguments) {
  if (arguments[1] % static_cast<std::int64_t>(block_size) != 0) return Error::invalid_argument;
  Request request = plain_request(format, CommandCode::create_field);
  request.subject = byte(arguments[0]);
  request.new_value = status_of_field(arguments[1], arguments[2], arguments[3] != 0);
  request.code = format.access_code;
  return request;
}
constexpr Request to_change_code(const Format& format, Arguments arguments) {
  Request request = plain_request(format, CommandCode::access_code);
  request.subject = byte(arguments[0]);
  request.code = byte(arguments[1]);
  request.new_value = byte(arguments[2]);
  return request;
}
constexpr Result<Request> to_set_baud(const Format& format, Arguments arguments) {
  const std::optional<std::uint8_t> rate = rate_index(arguments[0]);
  if (!rate) return Error::invalid_argument;
  Request request = plain_request(format, CommandCode::interface);
  request.subject = static_cast<std::uint8_t>((interface_at_shipping & ~rate_bits) | *rate);
  request.code = format.code0;
  return request;
}

// ---- Commands

constexpr Argument address{"address", "in the data field", 0, field_capacity - 1, 0, true, Role::address};
constexpr Argument field_number{"field", "data field: 0 to 13, or 255", 0, 255, 0, false, Role::page};
constexpr std::array<Argument, 3> read_arguments{
    {address, field_number, {"count", "bytes from the address on", 1, field_capacity, 1, false, Role::count}}};
constexpr std::array<Argument, 3> write_arguments{
    {address, {"value", "the byte", 0, 255, 0, true, Role::value}, field_number}};
constexpr std::array<Argument, 1> field_arguments{{{"field", "data field", 0, 255}}};
constexpr std::array<Argument, 4> create_arguments{
    {{"field", "data field", 0, user_fields - 1},
     {"size", "bytes: a multiple of 16", block_size, field_capacity, field_capacity, false},
     {"number", "of its access code", 0, 3, 0, false},
     {"writable", "1: it can be written", 0, 1, 1, false}}};
constexpr std::array<Argument, 3> code_arguments{{{"number", "of the access code", 0, 3},
                                                  {"old", "the access code that it has", 0, 255},
                                                  {"new", "the access code that it shall have", 0, 255}}};
constexpr std::array<Argument, 1> channel_arguments{{{"channel", "0x48: the temperature", 0, 255}}};
constexpr std::array<Argument, 1> position_arguments{{{"position", "with its turns, in counts", 0, UINT32_MAX}}};
constexpr std::array<Argument, 1> address_arguments{{{"new_address", "the new one", first_address, last_address}}};
constexpr std::array<Argument, 1> baud_arguments{
    {{"baud", "600, 1200, 2400, 4800, 9600, 19200 or 38400", rates.front(), rates.back()}}};

constexpr std::string_view no_turns(const Format& format) {
  return format.resolution().multiturn_bits == 0
             ? "this encoder has no turns (multiturn_bits says how many bits they have)"
             : "";
}

template <auto procedure, auto request, auto... bound>
constexpr CommandOf<Protocol> run(const absenc::Command& info) {
  return command<report, found, procedure, request, bound...>(info);
}
template <CommandCode one>
constexpr CommandOf<Protocol> ask(const absenc::Command& info) {
  return reading<report, plain<one>>(info);
}

constexpr auto commands = std::array{
    run<read_position, plain<CommandCode::position>>({"position", Verb::read, 0, "position, turns and alarms"}),
    run<read_status, plain<CommandCode::status>>({"status", Verb::run, 0, "status codes and their alarms"}),
    run<read_info, plain<CommandCode::type_label>>(
        {"info", Verb::info, 0, "type label, serial number and program version"}),
    reading<report, about<CommandCode::analog_value, temperature_channel>>(
        {"temperature", Verb::temperature, 0, "temperature of the encoder"}),
    run<set_zero, to_set_position>(
        {"zero", Verb::zero, 0, "make this the zero of the turn; the turns stay", {}, true, false}),
    run<reset_multiturn, to_set_position>(
        {"reset-multiturn", Verb::reset_multiturn, 0, "set the turns to zero", {}, true, false})
        .unless(no_turns),
    run<set_position, to_set_position>(
        {"set-position", Verb::run, 0, "set the position with its turns", position_arguments, true, false}),
    run<read_memory, to_read>({"memory-read", Verb::memory_read, 0, "read bytes of a data field", read_arguments}),
    run<write_memory, to_write>(
        {"memory-write", Verb::memory_write, 0, "write a byte of a data field", write_arguments, true, false}),
    run<ask_about, about<CommandCode::field_status>, CommandCode::field_status>(
        {"field-status", Verb::run, 0, "size and access of a data field", field_arguments}),
    run<create_field, to_create>({"create-field", Verb::run, 0, "create a data field", create_arguments, true, false}),
    ask<CommandCode::free_memory>({"free-memory", Verb::run, 0, "memory for which data fields can still be created"}),
    run<set_access_code, to_change_code>(
        {"set-access-code", Verb::run, 0, "change an access code", code_arguments, true, false}),
    run<ask_about, about<CommandCode::analog_value>, CommandCode::analog_value>(
        {"analog-value", Verb::run, 0, "value of an analog channel", channel_arguments}),
    ask<CommandCode::counter>({"counter", Verb::run, 0, "value of the counter"}),
    run<count_up, plain<CommandCode::count_up>>(
        {"count-up", Verb::run, 0, "increase the counter by one", {}, true, false}),
    run<clear_counter, to_clear_counter>({"clear-counter", Verb::run, 0, "set the counter to 0", {}, true, false}),
    run<reset, plain<CommandCode::reset>>({"reset", Verb::run, 0, "restart it", {}, true, false}),
    run<read_address, label_of_all>({"address", Verb::config_get, 0, "address of the only encoder of the line"}),
    run<set_address, about<CommandCode::set_address>>({"set-address", Verb::config_set, 0, "give it another address",
                                                       address_arguments, true, false, "address", "address"}),
    run<read_baud, plain<CommandCode::type_label>>({"baud", Verb::config_get, 0, "baud rate of its interface setting"}),
    run<set_baud, to_set_baud>(
        {"set-baud", Verb::config_set, 0, "give it another baud rate", baud_arguments, true, false, "baud", "baud"}),
    command<report, nodes, scan<Protocol, addresses, label_at, label_to_all>, label_of_all>(
        {"scan", Verb::scan, 0, "ask all encoders at once, then each of the 32 addresses", {}, false, false}),
};

// ---- Options and models

constexpr std::array<std::string_view, rates.size()> rate_names{"600",  "1200",  "2400", "4800",
                                                                "9600", "19200", "38400"};

constexpr auto options = OptionsOf{
    or_zero(option<&Format::singleturn_bits>(
        "singleturn_bits", "bits of the position within the turn; 0: asked from the encoder before each command",
        least_singleturn_bits, most_singleturn_bits)),
    option<&Format::multiturn_bits>("multiturn_bits", "bits of the turns; 0: none; -1: asked as well", -1,
                                    most_multiturn_bits),
    with_role<Role::encoder>(
        in_hex(option<&Format::address>("address", "of the encoder", first_address, last_address))),
    in_hex(option<&Format::code0>("code0", "code 0, which protects position and settings", 0, 255)),
    in_hex(option<&Format::access_code>("access_code", "of the data fields that are read and written", 0, 255)),
    with_role<Role::rate>(option<&Format::rate>("baud", "bits a second", rate_names)),
    in_hex(option<&Format::type>("type", "virtual encoder: its type in the type label; 0: as its resolution", 0, 255)),
    probeable(option<&Format::status_bytes>("status_bytes", "of the status in a reply; sources differ", 1, 2)),
    probeable(option<&Format::counter_bytes>("counter_bytes", "of the counter in a reply; no source says it", 1, 4)),
    probeable(option<&Format::free_bytes>(
        "free_bytes", "of the free memory in a reply; 1: in blocks of 16 bytes, 2: in bytes; no source says it", 1, 2)),
    option<&Format::serial_bytes>("serial_bytes", "characters of the serial number; no source says it", 1, 28),
    option<&Format::version_bytes>("version_bytes", "characters of the program version; no source says it", 0, 32),
};
constexpr auto models = std::array{
    ModelText{"HIPERFACE", "resolution as its type label says", 0, ""},
    ModelText{"SKM36", "12 bits, 4096 turns", 0, "singleturn_bits=12 multiturn_bits=12"},
    ModelText{"SKS36", "12 bits", 0, "singleturn_bits=12 multiturn_bits=0"},
    ModelText{"SRM50", "15 bits, 4096 turns", 0, "singleturn_bits=15 multiturn_bits=12"},
    ModelText{"SRS50", "15 bits", 0, "singleturn_bits=15 multiturn_bits=0"},
    ModelText{"SEL34", "9 bits, 4096 turns", 0, "singleturn_bits=9 multiturn_bits=12"},
    ModelText{"SEK34", "9 bits", 0, "singleturn_bits=9 multiturn_bits=0"},
    ModelText{"SCM60", "14 bits, 4096 turns", 0, "singleturn_bits=14 multiturn_bits=12"},
    ModelText{"SCS60", "14 bits", 0, "singleturn_bits=14 multiturn_bits=0"},
};

// ---- Captures

constexpr std::size_t size_of_reply(const Format& format, Bytes begin) {
  if (!is_address(begin[0])) return 0;
  if (begin.size() < 2) return 2;
  const auto code = static_cast<std::uint8_t>(begin[1] & ~error_bit);
  const std::optional<DataSizes> sizes = data_sizes(format, code);
  if (!sizes || code == static_cast<std::uint8_t>(CommandCode::reset)) return 0;
  // A reply may be shorter than its full length because it repeats fewer bytes of the request. It then ends where the
  // received characters end, if the checksum is right.
  const bool ends_here = begin.size() >= shortest_frame + sizes->least && checksum(begin) == 0;
  if (sizes->least < sizes->reply && ends_here && begin.size() < shortest_frame + sizes->reply) return begin.size();
  if (code != static_cast<std::uint8_t>(CommandCode::read_data)) return shortest_frame + sizes->reply;
  if (begin.size() < 5) return 5;
  return begin[4] > field_capacity ? 0 : shortest_frame + sizes->reply + begin[4];
}

/// Returns the request that a captured reply probably answers, if the capture does not contain it, or an error. Access
/// codes in the request are 0.
constexpr Result<Request> guess_request(const Format& format, Bytes reply) {
  if (reply.size() < shortest_frame) return Error::wrong_length;
  const auto code = static_cast<std::uint8_t>(reply[1] & ~error_bit);
  if (!is_address(reply[0]) || !data_sizes(format, code)) return Error::unexpected_reply;
  Request request{.command = static_cast<CommandCode>(code), .address = reply[0]};
  if (reply.size() > shortest_frame) request.subject = reply[2];
  const bool of_data = request.command == CommandCode::read_data || request.command == CommandCode::store_data;
  if (of_data && reply.size() > shortest_frame + 2) {
    request.first = reply[3];
    request.count = reply[4];
  }
  if (request.command == CommandCode::create_field && reply.size() > shortest_frame + 1) request.new_value = reply[3];
  return request;
}

/// Returns request_rejected if the encoder answered an invalid request with its status; otherwise returns `error`.
constexpr Error answer_to_bad(const Format& format, Bytes request, Error error, Bytes reply) {
  const bool refused = reply.size() == shortest_frame + format.status_bytes && checksum(reply) == 0 &&
                       begins_refusal(CommandCode::position, reply) && !request.empty() &&
                       (reply[0] == request[0] || request[0] == broadcast_address);
  return refused ? Error::request_rejected : error;
}

Follower* make_follower(const Options& values, std::span<std::byte> storage) {
  if (storage.size() < sizeof(AlarmFollower)) return nullptr;
  return new (storage.data()) AlarmFollower(options.format(values));
}

BitRanges bits_in(const Options& values, Frame, Frame reply, const FieldInfo& field) {
  return place_of(options.format(values), reply.bytes, field);
}

// For the three commands whose reply length is an option: returns a contradiction if `reply` is a reply to `command`
// whose data has not `size` bytes; otherwise an empty text.
std::string_view length_contradiction(CommandCode command, std::int64_t size, Bytes reply) {
  if (reply.size() < shortest_frame || checksum(reply) != 0) return {};
  const bool is_of = (reply[1] & ~error_bit) == static_cast<unsigned>(command);
  if (!is_of || static_cast<std::int64_t>(reply.size() - shortest_frame) == size) return {};
  return "a reply has another length";
}

// Stores in `values` the resolution that a captured type label or description reports, if the options do not state it.
// Returns false if the encoder reports another resolution than the options state.
bool take_resolution(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  const Format said = options.format(values);
  for (std::size_t i = 0; i < captures.size(); ++i) {
    const Bytes reply = captures[i].reply;
    if (reply.size() < shortest_frame || checksum(reply) != 0) continue;
    const Resolution bits = reported(reply);
    if (bits.singleturn_bits == 0) continue;
    const bool agrees = (said.singleturn_bits == 0 || said.singleturn_bits == bits.singleturn_bits) &&
                        (said.multiturn_bits < 0 || static_cast<unsigned>(said.multiturn_bits) == bits.multiturn_bits);
    const auto put = [&](std::size_t option, unsigned reports) {
      for (std::int64_t value = options.infos[option].minimum; value <= options.infos[option].maximum; ++value) {
        const bool is = value == static_cast<std::int64_t>(reports);
        sink.put({option, value, is, is ? 0 : i, is ? "the encoder reports it" : "the encoder reports another one"});
      }
      if (agrees) values.values[option] = reports;
    };
    put(options.find("singleturn_bits"), bits.singleturn_bits);
    put(options.find("multiturn_bits"), bits.multiturn_bits);
    return agrees;
  }
  return true;
}

bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  struct Length {
    std::size_t option;
    CommandCode command;
  };
  constexpr std::array<Length, 3> lengths{{{options.find("status_bytes"), CommandCode::status},
                                           {options.find("counter_bytes"), CommandCode::counter},
                                           {options.find("free_bytes"), CommandCode::free_memory}}};
  bool all = take_resolution(values, captures, sink);
  for (const Length& length : lengths) {
    const Option& option = options.infos[length.option];
    std::optional<std::int64_t> chosen;
    for (std::int64_t value = option.minimum; value <= option.maximum; ++value) {
      std::string_view why;
      std::size_t i = 0;
      while (i < captures.size() && (why = length_contradiction(length.command, value, captures[i].reply)).empty()) ++i;
      sink.put({length.option, value, why.empty(), why.empty() ? 0 : i, why.empty() ? "agrees with all frames" : why});
      if (why.empty() && (!chosen || value == values[length.option])) chosen = value;
    }
    if (chosen) values.values[length.option] = *chosen;
    all = all && chosen.has_value();
  }
  return all;
}

// ---- Declaration

constexpr auto known_as = std::array<std::string_view, 4>{"SICK", "Stegmann", "SKS36", "SEK37"};

constexpr Declaration<Protocol, VirtualEncoder> declaration{
    .id = "hiperface",
    .name = "SICK HIPERFACE (parameter channel)",
    .document = "SICK STEGMANN, Specification HIPERFACE motor feedback protocol, 8010701",
    .known_as = known_as,
    .link = LinkKind::half_duplex,
    .options = options.infos,
    .format = format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .frames_size = 4000,
    .report = report,
    .guess_request = guess_request,
    .reply_size = size_of_reply,
    .answer_to_bad = answer_to_bad,
    .bits = bits_in,
    .probe = probe,
    .follower = make_follower,
    .follower_storage = sizeof(AlarmFollower),
    .status = fields.of<&Values::status>(),
    .alarms = fields.of<&Values::alarms>(),
    .memory = memory_areas,
    .conditions = conditions,
    // A pause of 3 characters (33 bits) ends a frame; encoders make no pauses inside frames.
    .timing = {.pause_bits = 33,
               .turnaround = answer_time,
               .turnaround_limit = Protocol::host_times({.rate = 0}).answer_limit},
};

}  // namespace

constinit const Unit unit = Descriptor<declaration>::make();

}  // namespace absenc::hiperface
