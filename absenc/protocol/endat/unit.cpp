// SPDX-License-Identifier: Apache-2.0
// The commands of EnDat encoders, and the declaration of the unit.
#include "absenc/protocol/endat/unit.hpp"

#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/endat/alarm_follower.hpp"
#include "absenc/protocol/endat/device.hpp"
#include "absenc/protocol/endat/host.hpp"
#include "absenc/protocol/endat/procedures.hpp"
#include "absenc/protocol/endat/vectors.hpp"

namespace absenc::endat {

namespace {

using namespace author;

// ---- Reports

constexpr void put_request(FieldSink& sink, const Format&, const Request& request) {
  fields.put(sink, values_of(request));
}
constexpr void put_reply(FieldSink& sink, const Format& format, const Request& request, const Reply& reply) {
  fields.put(sink, values_of(format, request, reply));
}
constexpr void put_found(FieldSink& sink, const Format&, const ProcedureResult& found) { fields.put(sink, found); }

// Returns the explanation of an error, by the last request and reply.
Explanation explain(const Format&, Error error, Bytes request, Bytes reply) {
  const BitView bits{reply, 8 * reply.size()};
  const Result<Request> asked = decode_request({request, 8 * request.size()});
  if (error == Error::line_stuck && bits.size > turn_bits) {
    if (!bits[turn_bits]) {
      return {"behind the mode command the data line stayed low: no start bit came",
              "give the encoder more time with latency_us or a lower clock_khz; else check the data pair for a short"};
    }
    return {"behind the mode command the data line stayed high: the encoder drives nothing",
            "check supply, wiring and the direction of the transceiver; an encoder of EnDat 2.1 needs version=2.1"};
  }
  if (error == Error::truncated) {
    return {"the start bit came so late that bits of the reply are missing",
            "measure the delay with `absenc run ... line-delay` and set line_delay_ns, or raise latency_us"};
  }
  if (error == Error::bad_checksum && asked && has_parameters(asked->code)) {
    return {"the line damages the reply, or two encoders drive it", "check shielding, termination and common ground"};
  }
  if (error == Error::bad_checksum) {
    return {"the encoder has another number of bits than the options state, or the line damages its replies",
            "check singleturn_bits and multiturn_bits, lower clock_khz, check shielding and termination"};
  }
  if (error == Error::request_rejected && asked) {
    return {"the encoder repeats another MRS code or address than it was asked for",
            "check that this encoder has the area and the word, and that they may be written"};
  }
  return {};
}

constexpr Report<Protocol> report{.put_request = put_request, .put_reply = put_reply, .explain = explain};
constexpr Finding<Format, ProcedureResult> found{.put = put_found};

// ---- Commands

constexpr Argument area_argument{
    "area", "MRS code of the memory area", memory_areas.front().page, memory_areas.back().page, 0, true, Role::page};
constexpr Argument word_argument{"address", "of the word in its area", 0, 127, 0, true, Role::address};
constexpr std::array<Argument, 3> read_arguments{
    {area_argument, word_argument, {"count", "words from the address on", 1, most_words, 1, false, Role::count}}};
constexpr std::array<Argument, 3> write_arguments{
    {area_argument, word_argument, {"value", "the word", 0, 0xFFFF, 0, true, Role::value}}};
constexpr std::array<Argument, 1> recovery_arguments{{{"recovery", "0: 10 to 30 us; 1: 1.25 to 3.75 us", 0, 1}}};
constexpr std::array<Argument, 2> info_arguments{
    {{"info1", "MRS code of additional information 1, 0x40 to 0x4F; 0: as it is", 0, mrs::stop_info_1, 0, false},
     {"info2", "MRS code of additional information 2, 0x50 to 0x5F; 0: as it is", 0, mrs::stop_info_2, 0, false}}};
constexpr std::array<Argument, 2> test_arguments{
    {{"port", "of the test command", 0, 255}, {"instruction", "16 bits", 0, 0xFFFF, 0, false}}};
constexpr std::array<Argument, 2> communicate_arguments{
    {{"port", "address of the encoder", 0, 255}, {"instruction", "16 bits", 0, 0xFFFF}}};

constexpr Request ask_for_position(const Format& format) { return {.code = position_command(format)}; }
constexpr Request ask_for_position_with(const Format& format, Arguments) { return ask_for_position(format); }
constexpr Request ask_for_test_values(const Format&) { return {.code = ModeCommand::test_values}; }
template <ModeCommand code>
constexpr Request ask_with(const Format&, Arguments arguments) {
  return {.code = code,
          .byte = static_cast<std::uint8_t>(arguments.empty() ? 0 : arguments[0]),
          .word = static_cast<std::uint16_t>(arguments.size() < 2 ? 0 : arguments[1])};
}
template <std::uint8_t mrs>
constexpr Request ask_to_select(const Format&, Arguments) {
  return {.code = ModeCommand::select, .byte = mrs};
}
// A command that begins by selecting the area of its first argument.
constexpr Request ask_for_area(const Format& format, Arguments arguments) {
  if (format.version == CommandSet::v22) return {.code = ModeCommand::position_22};
  return {.code = ModeCommand::select, .byte = static_cast<std::uint8_t>(arguments[0])};
}

constexpr std::string_view no_22(const Format& format) {
  return format.version == CommandSet::v21 ? "this needs EnDat 2.2 (option version)" : "";
}
constexpr bool is_asked(const Format& format) { return !format.is_known(); }

template <auto procedure, auto request>
constexpr CommandOf<Protocol> run(const Command& info) {
  return command<report, found, procedure, request>(info);
}

constexpr Command read_info_of{"position", Verb::read, 0, "position, turns and error bits"};

// A command that sends one request with its arguments, and whose reply is the result.
template <ModeCommand code>
Procedure send(Dialog& dialog, ProcedureResult& result, Arguments arguments) {
  const Reply reply = co_await dialog.ask(ask_with<code>(dialog.format(), arguments)).changes();
  static_cast<Values&>(result) = values_of(dialog.format(), dialog.request(), reply);
  co_return done;
}

constexpr auto commands = std::array{
    reading<report, ask_for_position, ReadPosition>(read_info_of)
        .or_when(is_asked, run<read_position, ask_to_select<area::maker_1>>(read_info_of)),
    run<read_status, ask_for_position_with>({.name = "status",
                                             .verb = Verb::read_part,
                                             .id = 0,
                                             .meaning = "position, error messages and warnings",
                                             .reads_alarms = true}),
    run<clear_alarms, ask_to_select<area::status>>(
        {"clear-alarms", Verb::clear_alarms, 0, "clear error messages and warnings", {}, true, false}),
    run<read_info, ask_to_select<area::maker_1>>({"info", Verb::info, 0, "parameters that describe the encoder"}),
    run<read_temperature, ask_for_position_with>(
        {"temperature", Verb::temperature, 0, "temperature inside the encoder"})
        .unless(no_22),
    run<read_infos, ask_for_position_with>(
        {"additional", Verb::run, 0, "additional information, with a position", info_arguments})
        .unless(no_22),
    run<set_zero, ask_for_position_with>(
        {"zero",
         Verb::zero,
         0,
         "make this the zero, to a signal period, by the datum shift; resets the encoder",
         {},
         true,
         false}),
    run<reset, ask_with<ModeCommand::reset>>(
        {"reset", Verb::run, 0, "reset the encoder, as power off and on", {}, true, false}),
    run<reset_errors, ask_for_position_with>(
        {"error-reset", Verb::run, 0, "reset errors within a control cycle", {}, true, false})
        .unless(no_22),
    run<read_memory, ask_for_area>({"memory-read", Verb::memory_read, 0, "read words of the memory", read_arguments}),
    run<write_memory, ask_for_area>(
        {"memory-write", Verb::memory_write, 0, "write a word of the memory", write_arguments, true, false}),
    run<read_recovery, ask_to_select<area::status>>(
        {"recovery", Verb::config_get, 0, "recovery time after commands of EnDat 2.2"})
        .unless(no_22),
    run<set_recovery, ask_to_select<area::status>>({.name = "set-recovery",
                                                    .verb = Verb::config_set,
                                                    .id = 0,
                                                    .meaning = "select the recovery time after commands of EnDat 2.2",
                                                    .arguments = recovery_arguments,
                                                    .changes_encoder = true,
                                                    .repeatable = false,
                                                    .reads_back = "recovery",
                                                    .changes_option = "recovery"})
        .unless(no_22),
    reading<report, ask_for_test_values>({"test-values", Verb::run, 0, "test values of the encoder"}),
    run<send<ModeCommand::test>, ask_with<ModeCommand::test>>(
        {"test-command", Verb::run, 0, "send a test command to a port", test_arguments, true, false}),
    run<send<ModeCommand::communicate>, ask_with<ModeCommand::communicate>>(
        {"communicate", Verb::run, 0, "send a communication command", communicate_arguments, true, false}),
    run<measure_delay, ask_for_position_with>(
        {"line-delay", Verb::run, 0, "measure the delay of line and transceivers"}),
};

// ---- Declaration

constexpr std::array<std::string_view, 2> version_names{"2.1", "2.2"};
constexpr std::array<std::string_view, 2> recovery_names{"long", "short"};
constexpr std::array<std::string_view, 2> shift_names{"subtracted", "added"};

// The values of the options: those of the format, but the unit of length as a whole number.
struct GivenFormat : Format {
  std::int64_t unit_pm = 0;
};

constexpr auto options = OptionsOf{
    option<&Format::singleturn_bits>(
        "singleturn_bits", "bits of the position within the turn; 0: asked from the encoder (decode: 25)", 0, 40),
    option<&Format::multiturn_bits>("multiturn_bits", "bits of the turns; 0: none, or asked", 0, 16),
    option<&Format::position_bits>("position_bits", "linear encoders: bits of the position", 0, 40),
    decimal<6>(option<&GivenFormat::unit_pm>("unit_um", "linear encoders: um per count", 0, 1'000'000'000)),
    option<&Format::version>("version", "of EnDat, whose commands are used", version_names),
    with_role<Role::rate>(option<&Format::clock_khz>("clock_khz", "rate of the clock, kHz", 100, 16'000)),
    decimal<3>(
        option<&Format::latency>("latency_us", "longest time until the position is calculated, us", 1000, 100'000)),
    option<&Format::line_delay_ns>("line_delay_ns", "delay of line and transceivers, there and back, ns", 0, 10'000),
    option<&Format::recovery>("recovery", "recovery time after commands of EnDat 2.2", recovery_names),
    in_hex(option<&Format::info1>("info1", "additional information 1 that is selected, its MRS code; 0: none", 0,
                                  mrs::stop_info_1 - 1)),
    in_hex(option<&Format::info2>("info2", "additional information 2 that is selected, its MRS code; 0: none", 0,
                                  mrs::stop_info_2 - 1)),
    option<&Format::datum_shift>("datum_shift", "how the encoder applies its datum shift", shift_names),
};

constexpr Format format_by(const Options& values) {
  const GivenFormat given = options.format(values);
  Format format = given;
  format.unit_um = static_cast<double>(given.unit_pm) / 1e6;
  return format;
}

constexpr auto models = std::array{
    ModelText{"asked", "resolution asked from the encoder", 0, "singleturn_bits=0"},
    ModelText{"ECN-1325", "rotary, 25 bits, EnDat 2.2", 0, "singleturn_bits=25"},
    ModelText{"EQN-1337", "rotary, 25 bits, 4096 turns, EnDat 2.2", 0, "singleturn_bits=25 multiturn_bits=12"},
    ModelText{"ECN-1313", "rotary, 13 bits, EnDat 2.1", 0, "singleturn_bits=13 version=2.1"},
    ModelText{"EQN-1325", "rotary, 13 bits, 4096 turns, EnDat 2.1", 0,
              "singleturn_bits=13 multiturn_bits=12 version=2.1"},
    ModelText{"LC-415", "linear, 32 bits of 10 nm, EnDat 2.2", 0, "singleturn_bits=0 position_bits=32 unit_um=0.01"},
};

constexpr bool is_possible(const Format& format) {
  const bool selects_1 = format.info1 == 0 || format.info1 >= mrs::nothing;
  const bool selects_2 = format.info2 == 0 || format.info2 >= mrs::nothing_2;
  const bool both = format.is_linear() && format.singleturn_bits + format.multiturn_bits != 0;
  const bool is_scaled = !format.is_linear() || format.unit_um > 0;
  return selects_1 && selects_2 && !both && is_scaled && format.bits() <= most_bits &&
         (format.version == CommandSet::v22 || std::uint32_t{format.clock_khz} * 1000 <= fastest_21);
}

constexpr Resolution resolution_by(const Format& format) { return with_resolution(format).resolution(); }

// A reply without its request is taken to be that of a position of the version, as far as the bits allow.
constexpr Result<Request> guess_request(const Format& format, BitView) { return ask_for_position(format); }

// Returns the options with the resolution of a reading, if they leave it to the encoder.
Options learned(const Options& values, const Reading& reading) {
  if (format_by(values).is_known()) return values;
  Options now = values;
  const auto set = [&now](std::string_view name, std::int64_t value) { now.values[options.find(name)] = value; };
  if (is_linear(reading.unit_um)) {
    set("position_bits", reading.singleturn_bits);
    set("unit_um", static_cast<std::int64_t>(reading.unit_um * 1e6 + 0.5));
  } else {
    set("singleturn_bits", reading.singleturn_bits);
    set("multiturn_bits", reading.multiturn_bits);
  }
  return now;
}

Follower* make_follower(const Options& values, std::span<std::byte> storage) {
  if (storage.size() < sizeof(AlarmWordsFollower)) return nullptr;
  return new (storage.data()) AlarmWordsFollower(format_by(values));
}

BitRanges host_bits(const Options& values, Frame burst) { return host_ranges(format_by(values), to_bits(burst)); }

// The checksums cover neither the zeros before the start bit, nor the start bits, nor what follows the last checksum.
bool is_checked(const Options& values, Frame request, Frame reply, std::size_t bit) {
  const Format format = format_by(values);
  const BitView bits = to_bits(reply);
  Request asked = ask_for_position(format);
  if (!request.bytes.empty()) asked = decode_request(to_bits(request)).value_or(asked);
  const std::size_t first = find_start(bits) + 1;
  if (bit < first) return false;
  if (!has_position(asked.code)) return bit < first + reply_size(format, asked.code);
  const std::size_t end = first + position_size(format, asked.code);
  if (bit < end) return true;
  return is_22(asked.code) && bit < end + format.infos() * info_bits && (bit - end) % info_bits != 0;
}

constexpr auto known_as = std::array<std::string_view, 3>{"HEIDENHAIN", "EnDat 2.1", "EnDat 2.2"};

constexpr Declaration<Protocol, VirtualEncoder> declaration{
    .id = "endat",
    .name = "HEIDENHAIN EnDat",
    .document = "public sources on EnDat, README.md",
    .known_as = known_as,
    .link = LinkKind::clocked_bidirectional,
    .options = options.infos,
    .format = format_by,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .frames_size = 2600,
    .report = report,
    .resolution = resolution_by,
    .is_usable = is_possible,
    .guess_request = guess_request,
    .is_checked = is_checked,
    .host_bits = host_bits,
    .learned = learned,
    .follower = make_follower,
    .follower_storage = sizeof(AlarmWordsFollower),
    .alarms = fields.of<&Values::alarms>(),
    .memory = memory_areas,
    .conditions = conditions,
};

}  // namespace

constinit const Unit unit = Descriptor<declaration>::make();

}  // namespace absenc::endat
