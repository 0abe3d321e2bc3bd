// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/unit.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "absenc/protocol/e201/device.hpp"
#include "absenc/protocol/e201/fields.hpp"
#include "absenc/protocol/e201/host.hpp"
#include "absenc/protocol/e201/timing.hpp"
#include "absenc/protocol/e201/vectors.hpp"
#include "absenc/protocol/make.hpp"
#include "absenc/protocol/word_options.hpp"

namespace absenc::e201 {

namespace {

constexpr std::array<std::string_view, 2> carries_choices{"biss", "ssi"};

constexpr std::array<Option, 11> options{{
    singleturn_bits_option,
    multiturn_bits_option,
    multiturn_first_option,
    position_bits_option,
    unit_um_option,
    {.name = "carries", .meaning = "what the encoder speaks", .default_value = 0, .choices = carries_choices},
    {.name = "gray",
     .meaning = "SSI: turns and position are one Gray-coded number",
     .default_value = 0,
     .choices = boolean_choices,
     .describes_word = true},
    after_word_option,
    {.name = "latency_us",
     .meaning = "virtual encoder: time until its position is ready, us",
     .default_value = 10'000,
     .minimum = 0,
     .maximum = 1'000'000,
     .decimals = 3},
    {.name = "line_delay_ns",
     .meaning = "virtual encoder: delay of the line, there and back",
     .default_value = 0,
     .minimum = 0,
     .maximum = 100'000},
    {.name = "firmware",
     .meaning = "virtual interface: version; reading needs 1.16",
     .default_value = 116,
     .minimum = 0,
     .maximum = 9999,
     .decimals = 2},
}};
static_assert(options[option_unit_um].name == "unit_um" && options[option_firmware].name == "firmware");

constexpr auto models =
    position_models<option_singleturn_bits, option_multiturn_bits, option_position_bits, option_unit_um>;

constexpr std::array<Argument, 1> clock_arguments{
    {{"clock", "1 to 8, or 35 70 140 280 560 1100 2200 4400 kHz", 1, 4400}}};
constexpr std::array<Argument, 1> width_arguments{{{"bits", "of the position that ? and > give", 1, 64}}};
constexpr std::array<Argument, 1> sweep_arguments{{{"frames", "to read at each clock", 1, 1000, 20, false}}};

constexpr std::array<Command, 14> commands{{
    {"position", Verb::read, command::samples, "position, turns, error and warning"},
    {"info", Verb::info, command::version, "version, serial number, supply and MA clock of the interface"},
    {"clock", Verb::config_get, command::clock, "MA clock"},
    {"set-clock", Verb::config_set, command::set_clock, "set the MA clock", clock_arguments, true, false, "clock"},
    {"width", Verb::config_get, command::width, "width of the position that ? and > give"},
    {"set-width", Verb::config_set, command::set_width, "set that width", width_arguments, true, false, "width"},
    {"set-zero",
     Verb::run,
     command::zero,
     "the interface's own zero: decimal and hexadecimal count from here",
     {},
     true,
     false},
    {"clear-zero", Verb::run, command::clear_zero, "take that zero away", {}, true, false},
    {"decimal", Verb::read_part, command::decimal, "position from that zero, by ?"},
    {"hexadecimal", Verb::read_part, command::hexadecimal, "position from that zero, by >"},
    {"supply-on", Verb::run, command::supply_on, "switch the encoder's supply on", {}, true, false},
    {"supply-off", Verb::run, command::supply_off, "switch the encoder's supply off", {}, true, false},
    {"stream-off", Verb::run, command::stream_off, "end the stream of positions that somebody began"},
    {"clock-sweep", Verb::run, 0, "count the good frames at every MA clock and recommend one", sweep_arguments, false,
     false},
}};

constexpr auto fields = joined_fields(joined_fields(word_fields, biss::own_fields), own_fields);

// Whether a frame fits into the samples: of BiSS with the shortest ACK.
bool is_usable(const Format& format) {
  const bool is_biss = format.carries == Carries::biss;
  const unsigned samples = is_biss ? biss::idle_bits + 3 + biss::data_bits(format.biss) : 1 + format.ssi.word.bits();
  return absenc::is_usable(format.word()) && samples <= sample_bits;
}

Error decode_frame(const Options& values, Frame request, Frame reply, FieldSink& sink) {
  const Format format = to_format(values);
  if (!is_usable(format)) return Error::invalid_argument;
  return decode(format, request.bytes, reply.bytes, sink);
}

// 1 to 8; 0 when the argument is neither that nor one of the frequencies.
unsigned clock_of(std::int64_t argument) {
  if (argument <= static_cast<std::int64_t>(clocks_khz.size())) return static_cast<unsigned>(argument);
  const auto found = std::find(clocks_khz.begin(), clocks_khz.end(), argument);
  return found == clocks_khz.end() ? 0 : static_cast<unsigned>(found - clocks_khz.begin()) + 1;
}

// A sweep has no request of its own: it reads.
Result<std::size_t> encode(const Options&, const Command& command, Arguments arguments, MutableBytes request) {
  const std::uint8_t letter = command.id != 0 ? command.id : command::samples;
  unsigned value = 0;
  if (letter == command::set_clock) value = clock_of(arguments[0]);
  if (letter == command::set_clock && value == 0) return Error::invalid_argument;
  if (letter == command::set_width) value = static_cast<unsigned>(arguments[0]);
  const RequestText text = encode_request(letter, value);
  if (text.size() > request.size()) return Error::buffer_too_small;
  std::copy_n(text.view().begin(), text.size(), request.begin());
  return text.size();
}

Delimit delimit(const Options&, Direction direction, Bytes bytes) {
  if (bytes.empty()) return {Delimit::Kind::incomplete, 1};
  if (direction == Direction::request) {
    if (!command::is_known(bytes[0])) return {Delimit::Kind::no_frame};
    const std::size_t length = encode_request(bytes[0]).size();
    return {bytes.size() < length ? Delimit::Kind::incomplete : Delimit::Kind::complete, length};
  }
  const auto end = std::find(bytes.begin(), bytes.end(), static_cast<std::uint8_t>(end_of_line));
  const auto length = static_cast<std::size_t>(end - bytes.begin()) + 1;
  return {end == bytes.end() ? Delimit::Kind::incomplete : Delimit::Kind::complete, length};
}

Any<Conversation> host(const Options& values, const Command& command, Arguments arguments,
                       std::span<std::byte> storage) {
  const Format format = to_format(values);
  const bool readable = is_usable(format) && absenc::is_usable(format.scale());
  switch (command.id) {
    case command::samples:
      return readable ? make_host<ReadPosition>(storage, format) : Any<Conversation>{};
    case command::version:
      return make_host<Info>(storage);
    case command::set_clock:
      if (clock_of(arguments[0]) == 0) return {};
      return make_host<Set>(storage, command::set_clock, clock_of(arguments[0]));
    case command::set_width:
      return make_host<Set>(storage, command::set_width, static_cast<unsigned>(arguments[0]));
    case command::zero:
      return make_host<Zero>(storage, format);
    case command::supply_on:
    case command::supply_off:
      return make_host<SwitchSupply>(storage, command.id == command::supply_on);
    case command::clear_zero:
    case command::stream_off:
      return make_host<Tell>(storage, command.id);
    case 0:
      return readable ? make_host<ClockSweep>(storage, format, static_cast<unsigned>(arguments[0]))
                      : Any<Conversation>{};
    default:
      return make_host<Query>(storage, command.id);
  }
}

Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
  const Format format = to_format(values);
  if (!is_usable(format)) return {};
  const auto firmware = static_cast<unsigned>(values[option_firmware]);
  const AdapterSettings settings{
      .firmware = {firmware / 100, firmware % 100},
      .behaviour = {.latency = Time(values[option_latency_us]), .line_delay = Time(values[option_line_delay_ns])}};
  return make_device<VirtualAdapter>(storage, format, shaft, settings);
}

Resolution resolution(const Options& values) {
  const Format format = to_format(values);
  return resolution_of(format.word(), format.scale());
}

Explanation explain_frame(const Options& values, Error error, Frame request, Frame reply) {
  const std::uint8_t letter = request.bytes.empty() ? command::samples : request.bytes[0];
  return explain(to_format(values), error, letter, reply.bytes);
}

// No document says whether the others have a reply.
bool answered(const Options&, Frame request) {
  constexpr std::string_view lines = "4vse?>mb";
  return index_of(lines, static_cast<char>(request.bytes[0])) < lines.size();
}

// What follows the CRC is ignored, capitals are the same digits, and SSI has no checksum.
bool covered(const Options& values, Frame request, Frame reply, std::size_t bit) {
  const Format format = to_format(values);
  if (!request.bytes.empty() && request.bytes[0] != command::samples) return false;  // text
  const Result<Position> position = decode_position(format, reply.bytes);
  if (!position || format.carries == Carries::ssi) return false;
  const std::size_t character = bit / 8;
  if (character + 1 == samples_length) return true;
  const std::uint8_t right = reply.bytes[character];
  const int before = hex_digit(static_cast<char>(right));
  const int after = hex_digit(static_cast<char>(right ^ 1u << bit % 8));
  if (after < 0) return true;
  const auto changed = static_cast<unsigned>(before ^ after);
  if (changed == 0) return false;
  const std::size_t first_changed = character * 4 + static_cast<unsigned>(std::countl_zero(changed << 28));
  return first_changed < biss::idle_bits + position->ack_bits + 2 + biss::data_bits(format.biss);
}

}  // namespace

Format to_format(const Options& values) {
  const PositionBits bits = position_bits(values, option_singleturn_bits);
  const Scale scale = scale_of(values, option_position_bits, option_unit_um);
  Format format;
  format.carries = static_cast<Carries>(values[option_carries]);
  format.biss = {.word = biss::word_with_status(bits), .scale = scale};
  format.ssi = {.word = ssi::word_with(bits, values[option_gray] != 0, ssi::ErrorBit::none, Parity::none),
                .after_word = static_cast<ssi::AfterWord>(values[option_after_word]),
                .scale = scale};
  if (values.has_word()) format.biss.word = format.ssi.word = values.word;
  return format;
}

constinit const Unit unit{
    .id = "e201",
    .name = "RLS E201-9S USB interface",
    .document = "RLS E201-9S Decoding the BiSS information",
    .link = LinkKind::full_duplex,
    .line = line_settings,
    .options = options,
    .models = models,
    .fields = fields,
    .commands = commands,
    .vectors = vectors,
    .status = nullptr,
    .alarms = &fields[word_field_alarms],
    .host_storage = std::max({sizeof(ReadPosition), sizeof(Query), sizeof(Info), sizeof(Set), sizeof(SwitchSupply),
                              sizeof(Zero), sizeof(Tell), sizeof(ClockSweep)}),
    .device_storage = sizeof(VirtualAdapter),
    .decode = decode_frame,
    .encode = encode,
    .delimit = delimit,
    .host = host,
    .device = device,
    .resolution = resolution,
    .covered = covered,
    .explain = explain_frame,
    .timing = {.turnaround_limit = answer_limit},
    .answered = answered,
};

}  // namespace absenc::e201
