// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/unit.hpp"

#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/esl/device.hpp"
#include "absenc/protocol/esl/host.hpp"
#include "absenc/protocol/esl/probe.hpp"
#include "absenc/protocol/esl/vectors.hpp"

namespace absenc::esl {

namespace {

using namespace author;

constexpr Argument address{"address", "of the byte", 0, last_address, 0, true, Role::address};
constexpr Argument page{"page", "0 to 6, 8 or 14", 0, last_page, 0, false, Role::page};
constexpr std::array<Argument, 3> read_arguments{
    {address, page, {"count", "bytes from the address on", 1, last_address + 1, 1, false, Role::count}}};
constexpr std::array<Argument, 4> write_arguments{
    {address,
     {"value", "the byte", 0, 255, 0, true, Role::value},
     page,
     {"force", "1: also pages with calibration, lock bits and undescribed commands", 0, 1, 0, false, Role::force}}};
constexpr std::array<Argument, 1> page_arguments{{{"page", "0 to 6, 8 or 14", 0, last_page}}};

constexpr std::uint8_t byte_of(std::int64_t argument) { return static_cast<std::uint8_t>(argument); }

// ---- Requests of the commands

template <DataId data>
constexpr Request ask(const Profile& profile, Arguments) {
  return {data, profile.address};
}
constexpr Request read_at(const Profile& profile, Arguments arguments) {
  return {DataId::read_memory, profile.address, byte_of(arguments[0])};
}
constexpr Request write_at(const Profile& profile, Arguments arguments) {
  return {DataId::write_memory, profile.address, byte_of(arguments[0]), byte_of(arguments[1])};
}
constexpr Request read_info(const Profile& profile, Arguments) {
  if (profile.bus == sharing_yes) return {DataId::alarms, profile.address};
  return {DataId::read_memory, profile.address, error_info_address};
}
constexpr Request ask_position(const Profile& profile, Arguments) { return {position_id(profile), profile.address}; }
constexpr Request select(const Profile& profile, Arguments arguments) {
  return {DataId::write_memory, profile.address, page_select_address, byte_of(arguments[0])};
}
constexpr std::string_view no_memory(const Profile& profile) {
  if (profile.bus != sharing_yes) return {};
  return "memory cannot be reached by broadcast or with several encoders on the line (Figure 18): connect this one "
         "alone and say bus=false; nothing was sent";
}

constexpr std::string_view no_turns(const Profile& profile) {
  return profile.turns ? "" : "an encoder of one turn counts none (turns=false); nothing was sent";
}

// ---- Errors

// Returns the request of an exchange. If `request` is empty, returns the request that the reply echoes, or an error.
constexpr Result<Request> request_behind(const Profile& profile, Bytes request, Bytes reply) {
  if (!request.empty()) return decode_request(profile, request);
  const auto id = data_id(reply[0]);
  if (!id) return Error::unexpected_reply;
  bool busy = false;
  return detail::split_request(profile, *id, reply, busy);
}

// Returns the check that the reply has failed if decoding the reply gave the error `error`; `passed` if it failed none.
Check check_of(const Profile& profile, Error error, Bytes request, Bytes reply) {
  if (reply.empty()) return Check::passed;
  if (const Check refusal = check_refusal(profile, request, reply); refusal != Check::passed) return refusal;
  const Result<Request> asked = request_behind(profile, request, reply);
  if (!asked) return Check::passed;
  Reply ignored;
  const Check check = check_reply(profile, *asked, reply, ignored);
  return error_of(check) == error ? check : Check::passed;
}

// ---- Reports of frames and of procedures' results

constexpr Shown values_of_request(const Profile& profile, const Request& request) { return {profile, request}; }
constexpr Shown values_of_reply(const Profile& profile, const Request&, const Reply& reply) {
  Shown shown(reply);
  shown.has_turns = profile.turns;
  return shown;
}
void put_found(FieldSink& sink, const Profile& profile, const ProcedureResult& found) {
  Shown shown = found;
  shown.has_turns = found.has_turns && profile.turns;
  fields.put(sink, shown);
}
void put_safe(FieldSink& sink, const Profile& profile, const SafePositionResult& found) {
  put_found(sink, profile, found);
}
void put_nodes(FieldSink& sink, const Profile&, const Nodes& nodes) {
  for (std::uint8_t node = 0; node < most_encoders; ++node) {
    const std::optional<Reply>& reply = nodes.answers[node];
    const Check trouble = nodes.troubles[node];
    if (!reply && !nodes.disturbed[node] && trouble == Check::passed) continue;
    Shown node_shown;
    node_shown.encoder_address = node;
    node_shown.clash = nodes.disturbed[node];
    if (trouble != Check::passed) node_shown.trouble = text_of(trouble).sentence;
    node_shown.reply = reply;
    fields.put(sink, node_shown);
    if (reply) sink.put_reading(to_reading(*reply));
  }
}
// Writes an explanation of the last exchange of `host`, if there is one.
void tell(Sentence& words, const HostOf<Protocol>& host) {
  const Profile& profile = host.format();
  const Bytes request = host.exchange().sent;
  if (host.error() == Error::timeout) {
    words.add("it is also silent when request_crc, crc_bit_order or address is another");
    const std::optional<DataId> asked = request.empty() ? std::nullopt : data_id(request[0]);
    if (asked && is_memory_access(*asked)) {
      words.add_part("and to memory requests when others share its line (Figure 18)");
    }
    return;
  }
  if (host.is_disturbed()) return;
  const Check check = check_of(profile, host.error(), request, host.reply());
  if (check == Check::passed) return;
  words.add(text_of(check).sentence);
  std::string_view before = "; the reply is good with the profile ";
  const auto change = find_change(profile, host.reply());
  for (const OptionValue& one : change.view()) {
    const Option& option = options.infos[one.option];
    words.add(before).add(option.name).add("=").add(option.choices[static_cast<std::size_t>(one.value)]);
    before = " ";
  }
}
Explanation explain_reply(const Profile& profile, Error error, Bytes request, Bytes reply) {
  const Check check = check_of(profile, error, request, reply);
  if (check == Check::length) return {};  // for a wrong length, the general text of the error is enough
  return {.detail = text_of(check).sentence};
}

constexpr Report<Protocol, HostOf<Protocol>> report{
    .put_request = put_values<fields, values_of_request>,
    .put_reply = put_values<fields, values_of_reply>,
    .explain = explain_reply,
    .tell = tell,
};
constexpr Finding<Profile, ProcedureResult> found{.put = put_found};
constexpr Finding<Profile, SafePositionResult> found_safe{.put = put_safe};
constexpr Finding<Profile, Nodes> nodes{.put = put_nodes};

template <DataId data>
constexpr CommandOf<Protocol> read(std::string_view name, Verb verb, std::string_view meaning) {
  return reading<report, ask<data>>({name, verb, 0, meaning});
}
template <auto procedure, auto request, auto... bound>
constexpr CommandOf<Protocol> run(const Command& info) {
  return command<report, found, procedure, request, bound...>(info);
}
template <DataId data>
constexpr CommandOf<Protocol> reset_by(std::string_view name, Verb verb, std::string_view meaning) {
  return run<reset, ask<data>, data>({name, verb, 0, meaning, {}, true, false});
}

constexpr auto commands = std::array{
    reading<report, ask_position>({"position", Verb::read, 0, "position, turns and alarms of both channels"}),
    read<DataId::singleturn>("singleturn", Verb::read_part, "position within the turn, both channels"),
    read<DataId::position_short>("position-short", Verb::read_part, "position and turns, one channel, no alarms"),
    read<DataId::singleturn_short>("singleturn-short", Verb::read_part,
                                   "position within the turn, one channel, no alarms"),
    read<DataId::calibration>("calibration", Verb::read_part, "position within the turn as each channel sees it"),
    command<report, found_safe, read_safely, ask_position>(
        {.name = "safe-position",
         .verb = Verb::run,
         .id = 0,
         .meaning = "a position that passed every check of a safety reader (not a certified safety function)",
         .repeatable = false}),
    run<read_encoder_id, ask<DataId::encoder_id>>({"encoder-id", Verb::info, 0, "encoder id", {}, false, false}),
    read<DataId::alarms>("alarms", Verb::info, "alarms of both channels"),
    read<DataId::temperature>("temperature", Verb::temperature, "temperature inside the encoder"),
    run<read_error_info, read_info>(
        {"led-or-lissajous", Verb::run, 0, "which of the two is behind led_or_lissajous_error"}),
    command<report, nodes, scan, ask<DataId::singleturn_short>>(
        {"scan", Verb::scan, 0, "who answers on the line", {}, false, false}),
    reset_by<DataId::zero>("zero", Verb::zero, "make this the zero of the turn"),
    reset_by<DataId::clear_alarms>("clear-alarms", Verb::clear_alarms, "clear the alarms that can be cleared"),
    reset_by<DataId::reset_multiturn>("reset-multiturn", Verb::reset_multiturn, "set the turns to zero")
        .unless(no_turns),
    run<read_memory, read_at>({"memory-read", Verb::memory_read, 0, "read EEPROM, MTP or registers", read_arguments})
        .unless(no_memory),
    run<write_memory, write_at>(
        {"memory-write", Verb::memory_write, 0, "write a byte of the memory", write_arguments, true, false})
        .unless(no_memory),
    run<select_page, select>({"select-page", Verb::run, 0, "select a memory page", page_arguments, true, true})
        .unless(no_memory),
};

// ---- Declaration

template <Channel channel>
constexpr const FieldInfo* status_of = fields.of<detail::in<channel, part::status, &ChannelReply::status>>();
template <Channel channel>
constexpr const FieldInfo* alarms_of = fields.of<detail::in<channel, part::alarms, &ChannelReply::alarms>>();
constexpr auto models =
    std::array{ModelText{"QS35-M40M-E12F", "24 bits, 65536 turns, two channels (SIL3)", 10'000, "turns=true"},
               ModelText{"single-turn", "24 bits, one turn, two channels (SIL3)", 10'000, "turns=false"}};

constexpr LineSettings line_of(const Profile&) { return line_settings; }
constexpr Resolution resolution_of(const Profile& profile) {
  return {singleturn_bits, profile.turns ? multiturn_bits : 0};
}
BitRanges bits_in(const Options& values, Frame, Frame reply, const FieldInfo& field) {
  return place_of(options.format(values), reply.bytes, field);
}
constexpr std::size_t size_of_reply(const Profile& profile, Bytes begin) {
  return Protocol::request_size(profile, begin) == 0 ? 0 : reply_length(*data_id(begin[0]));
}
// Returns the error of the refusal that the reply states; if it states none, returns `error`.
constexpr Error answer_to_bad(const Profile& profile, Bytes request, Error error, Bytes reply) {
  const Check refusal = check_refusal(profile, request, reply);
  return refusal == Check::passed ? error : error_of(refusal);
}
constexpr Result<Request> guess_request(const Profile& profile, Bytes reply) {
  const Error refused = answer_to_bad(profile, {}, Error::none, reply);
  return refused == Error::none ? request_behind(profile, {}, reply) : Result<Request>(refused);
}

constexpr auto known_as = std::array<std::string_view, 1>{"QS35"};

constexpr Declaration<Protocol, VirtualEncoder, HostOf<Protocol>> declaration{
    .id = "esl",
    .name = "QS35 ESL (safety encoder, two channels)",
    .document = "QS35 ESL Protocol Specification, rev 1.5",
    .known_as = known_as,
    .link = LinkKind::half_duplex,
    .options = options.infos,
    .format = format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .frames_size = 1200,
    .report = report,
    .line = line_of,
    .resolution = resolution_of,
    .guess_request = guess_request,
    .reply_size = size_of_reply,
    .answer_to_bad = answer_to_bad,
    .bits = bits_in,
    .probe = probe,
    .status = status_of<Channel::one>,
    .alarms = alarms_of<Channel::one>,
    .second_status = status_of<Channel::two>,
    .second_alarms = alarms_of<Channel::two>,
    .memory = memory_map,
    .conditions = conditions,
    .timing = {.pause_bits = 1, .turnaround = answer_time, .turnaround_limit = answer_limit},
};

}  // namespace

constinit const Unit unit = Descriptor<declaration>::make();

}  // namespace absenc::esl
