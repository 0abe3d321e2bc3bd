// SPDX-License-Identifier: Apache-2.0
// The commands of encoders with Nikon's A-format, and the declaration of the unit.
#include "absenc/protocol/nikon/unit.hpp"

#include <array>
#include <optional>

#include "absenc/protocol/author/scan.hpp"
#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/nikon/device.hpp"
#include "absenc/protocol/nikon/host.hpp"
#include "absenc/protocol/nikon/procedures.hpp"
#include "absenc/protocol/nikon/status_follower.hpp"
#include "absenc/protocol/nikon/vectors.hpp"

namespace absenc::nikon {

namespace {

using namespace author;

// ---- Reports

constexpr void put_request(FieldSink& sink, const Format&, const Request& request) {
  fields.put(sink, values_of(request));
}
constexpr void put_reply(FieldSink& sink, const Format& format, const Request& request, const Reply& reply) {
  for (std::size_t i = 0; i < reply.count; ++i) {
    Values values = values_of(format, request.code, reply.at(i));
    if (reply.alarms_read) {
      values.alarms = reply.alarms_read;
      values.command.reset();  // a composed frame has two requests with different codes, so no code is shown
    }
    fields.put(sink, values);
  }
}
constexpr void put_found(FieldSink& sink, const Format&, const ProcedureResult& found) { fields.put(sink, found); }
void put_nodes(FieldSink& sink, const Format&, const Nodes<encoder_count>& nodes) {
  for (std::size_t i = 0; i < encoder_count; ++i) {
    if (!nodes.there[i]) continue;
    fields.put(sink, {.encoder_address = static_cast<std::uint8_t>(i), .clash = nodes.clash[i]});
  }
}

constexpr Report<Protocol> report{.put_request = put_request, .put_reply = put_reply};
constexpr Finding<Format, ProcedureResult> found{.put = put_found};
constexpr Finding<Format, Nodes<encoder_count>> nodes{.put = put_nodes};

// ---- Commands

constexpr Argument word_address{"address", "of the word", 0, word_count - 1, 0, true, Role::address};
constexpr Argument encoder_address{"address", "the new one, 0 to 7", 0, encoder_count - 1};
constexpr Argument identification{"identification", "24 bits", 0, 0xFFFFFF};
constexpr std::array<Argument, 2> read_arguments{
    {word_address, {"count", "words from the address on", 1, word_count, 1, false, Role::count}}};
constexpr std::array<Argument, 2> write_arguments{
    {word_address, {"value", "the word", 0, 0xFFFF, 0, true, Role::value}}};
constexpr std::array<Argument, 1> address_arguments{{encoder_address}};
constexpr std::array<Argument, 1> identity_arguments{{identification}};
constexpr std::array<Argument, 2> assign_arguments{{encoder_address, identification}};

// Returns the request for a command. Requests to all encoders have the highest address, as in TI's driver.
template <Code code>
constexpr Request ask_for(const Format& format, Arguments = {}) {
  return {.code = code, .address = is_for_all(code) ? std::uint8_t{encoder_count - 1} : format.address};
}
constexpr Request request_to(std::size_t address) { return {.address = static_cast<std::uint8_t>(address)}; }
constexpr Request read_at(const Format& format, Arguments arguments) {
  return {.code = Code::read_memory, .address = format.address, .word = static_cast<std::uint8_t>(arguments[0])};
}
constexpr Request write_at(const Format& format, Arguments arguments) {
  return {.code = Code::write_memory,
          .address = format.address,
          .word = static_cast<std::uint8_t>(arguments[0]),
          .value = static_cast<std::uint32_t>(arguments[1])};
}
constexpr Request write_identity_of(const Format& format, Arguments arguments) {
  return {.code = Code::write_identity, .address = format.address, .value = static_cast<std::uint32_t>(arguments[0])};
}
constexpr Request set_address_to(const Format&, Arguments arguments) {
  return {.code = Code::set_address, .address = static_cast<std::uint8_t>(arguments[0])};
}
constexpr Request assign_address_to(const Format&, Arguments arguments) {
  return {.code = Code::assign_address,
          .address = static_cast<std::uint8_t>(arguments[0]),
          .value = static_cast<std::uint32_t>(arguments[1])};
}
constexpr std::string_view no_turns(const Format& format) {
  return format.multiturn_bits == 0 ? "this encoder has no turns (multiturn_bits)" : "";
}

template <Code code>
constexpr CommandOf<Protocol> read(const Command& info) {
  return reading<report, ask_for<code>, ReadPosition>(info);
}
template <auto procedure, auto request, auto... bound>
constexpr CommandOf<Protocol> run(const Command& info) {
  return command<report, found, procedure, request, bound...>(info);
}
template <Code code>
constexpr CommandOf<Protocol> reset_of(std::string_view name, Verb verb, std::string_view meaning) {
  return run<reset, ask_for<code>, code>({name, verb, 0, meaning, {}, true, false});
}

constexpr auto commands = std::array{
    read<Code::position>({"position", Verb::read, 0, "position and turns, and the alarms if there is one"}),
    read<Code::lower>({"singleturn", Verb::read_part, 0, "position within the turn, from the lower 24 bits"}),
    read<Code::upper>({"multiturn", Verb::read_part, 0, "turns, from the upper 24 bits"}).unless(no_turns),
    read<Code::with_alarms>({.name = "singleturn-alarms",
                             .verb = Verb::read_part,
                             .id = 0,
                             .meaning = "position within the turn and alarms, with one request",
                             .reads_alarms = true}),
    read<Code::with_temperature>(
        {"singleturn-temperature", Verb::read_part, 0, "position within the turn and temperature, with one request"}),
    read<Code::alarms>({"status", Verb::run, 0, "alarms"}),
    read<Code::all_positions>({"all-positions", Verb::run, 0, "position and turns of all encoders of the line"}),
    read<Code::all_alarms>({"all-status", Verb::run, 0, "alarms of all encoders of the line"}),
    read<Code::temperature>({"temperature", Verb::temperature, 0, "temperature of the encoder"}),
    read<Code::read_identity>({"identity", Verb::info, 0, "identification code"}),
    read<Code::read_identity>({"identification", Verb::config_get, 0, "identification code"}),
    read<Code::read_only_identity>(
        {"only-encoder", Verb::run, 0, "address and identification of the only encoder of the line"}),
    reset_of<Code::clear_alarms>("clear-alarms", Verb::clear_alarms, "clear all alarms"),
    reset_of<Code::zero>("zero", Verb::zero, "make this the zero of the turn"),
    reset_of<Code::clear_both>("reset-multiturn", Verb::reset_multiturn, "set the turns to zero and clear all alarms")
        .unless(no_turns),
    reset_of<Code::clear_turns>("clear-turns", Verb::run, "set the turns to zero and keep the alarms").unless(no_turns),
    run<read_memory, read_at>({"memory-read", Verb::memory_read, 0, "read words of the EEPROM", read_arguments}),
    run<write_memory, write_at>(
        {"memory-write", Verb::memory_write, 0, "write a word of the user's EEPROM", write_arguments, true, false}),
    run<write_identity, write_identity_of>({"set-identification", Verb::config_set, 0, "give it another identification",
                                            identity_arguments, true, false, "identification"}),
    run<set_address, set_address_to>({.name = "address",
                                      .verb = Verb::config_set,
                                      .id = 0,
                                      .meaning = "give another address to the only encoder of the line",
                                      .arguments = address_arguments,
                                      .changes_encoder = true,
                                      .repeatable = false,
                                      .changes_option = "address"}),
    run<assign_address, assign_address_to>({"assign-address", Verb::run, 0,
                                            "give an address to the encoder with an identification", assign_arguments,
                                            true, false}),
    command<report, nodes, scan<Protocol, encoder_count, request_to>, ask_for<Code::position>>(
        {"scan", Verb::scan, 0, "ask each of the eight addresses", {}, false, false}),
};

// ---- Declaration

constexpr std::array<std::string_view, rates.size()> rate_names{"2500000", "4000000", "6666667", "8000000", "16000000"};
constexpr std::array<std::string_view, 2> order_names{"low", "high"};

constexpr auto options = OptionsOf{
    option<&Format::singleturn_bits>("singleturn_bits", "bits of the position within the turn", short_bits, 24),
    option<&Format::multiturn_bits>("multiturn_bits", "bits of the turns; 0: none", 0, 16),
    with_role<Role::encoder>(option<&Format::address>("address", "of the encoder on its line", 0, encoder_count - 1)),
    with_role<Role::rate>(option<&Format::rate>("rate", "bits per second", rate_names)),
    probeable(option<&Format::bit_order>(
        "bit_order", "which bit of a word of the EEPROM, and of the identification, is sent first", order_names)),
};
constexpr auto models = std::array{
    ModelText{"MAR-MC42A", "20 bits, 65536 turns, 2.5 Mbit/s", 6000, "singleturn_bits=20 multiturn_bits=16"},
};

constexpr Result<Request> guess_request(const Format&, Bytes reply) { return request_of_reply(reply); }
constexpr std::size_t size_of_reply(const Format&, Bytes begin) { return reply_size(begin); }

BitRanges bits_in(const Options& values, Frame request, Frame reply, const FieldInfo& field) {
  const Format format = options.format(values);
  const Result<Request> asked =
      request.bytes.empty() ? request_of_reply(reply.bytes) : decode_request(format, request.bytes);
  // With several replies a field occurs several times, so no bits are returned.
  if (!asked || reply.bytes.size() != reply_length(asked->code)) return {};
  return place_of(format, asked->code, field);
}

// Returns the EEPROM word 0xF9 that the reply of a capture carries, its first bit on the wire as the lowest; no value
// if the reply carries another word or none.
std::optional<std::uint64_t> temperature_word(const Capture& capture) {
  const Result<Request> request =
      capture.request.empty() ? request_of_reply(capture.reply) : decode_request({}, capture.request);
  if (!request || !is_memory_access(request->code)) return std::nullopt;
  const Result<Reply> reply = decode_reply({}, *request, capture.reply);
  if (!reply || reply->data >> 16 != temperature_address) return std::nullopt;
  return reply->data & 0xFFFF;
}
// Finds the value of the option bit_order. The EEPROM word 0xF9, a temperature, has only 10 bits: its other six bits
// are 0 and can show in which order the bits are sent.
bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  const std::size_t option = options.find("bit_order");
  // For each bit order: index of the first capture that contradicts this order; no value if none does.
  std::array<std::optional<std::size_t>, order_names.size()> against{};
  for (std::size_t i = 0; i < captures.size(); ++i) {
    const std::optional<std::uint64_t> word = temperature_word(captures[i]);
    if (!word) continue;
    if (*word >> 10 != 0 && !against[0]) against[0] = i;
    if ((*word & low_mask(6)) != 0 && !against[1]) against[1] = i;
  }
  for (std::size_t order = 0; order < against.size(); ++order) {
    sink.put({.option = option,
              .value = static_cast<std::int64_t>(order),
              .possible = !against[order],
              .capture = against[order].value_or(0),
              .why = against[order] ? "the temperature in word 0xF9 has more than 10 bits in this order"
                                    : "no word 0xF9 contradicts this order"});
  }
  if (against[0] && against[1]) return false;
  if (against[0] || against[1]) values.values[option] = against[0] ? 1 : 0;
  return true;
}

constexpr std::size_t follower_storage = sizeof(StatusFollower);
Follower* make_follower(const Options& values, std::span<std::byte> storage) {
  return absenc::detail::make_in<StatusFollower>(storage, options.format(values));
}

constexpr auto known_as = std::array<std::string_view, 2>{"Nikon", "A-format"};

constexpr Declaration<Protocol, VirtualEncoder> declaration{
    .id = "nikon",
    .name = "Nikon A-format",
    .document = "public sources on the A-format, README.md",
    .known_as = known_as,
    .link = LinkKind::half_duplex,
    .options = options.infos,
    .format = format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .frames_size = 2600,
    .report = report,
    .guess_request = guess_request,
    .reply_size = size_of_reply,
    .bits = bits_in,
    .probe = probe,
    .remembered = remembered,
    .follower = make_follower,
    .follower_storage = follower_storage,
    .alarms = fields.of<&Values::alarms>(),
    .memory = memory_areas,
    .conditions = conditions,
    .timing = {.pause_bits = 5,
               .frame_pause = 3 * frame_pause,
               .turnaround = answer_time,
               .turnaround_limit = answer_limit},
};

}  // namespace

constinit const Unit unit = Descriptor<declaration>::make();

}  // namespace absenc::nikon
