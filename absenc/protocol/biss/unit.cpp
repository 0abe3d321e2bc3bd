// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/unit.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/biss/fields.hpp"
#include "absenc/protocol/biss/vectors.hpp"
#include "absenc/protocol/make.hpp"
#include "absenc/protocol/word_options.hpp"

namespace absenc::biss {

namespace {

constexpr std::array<std::string_view, 2> check_choices{"crc6", "crc16"};

constexpr std::array<Option, 10> options{{
    singleturn_bits_option,
    multiturn_bits_option,
    multiturn_first_option,
    position_bits_option,
    unit_um_option,
    {.name = "check",
     .meaning = "crc16: BiSS Safety's life counter and CRC-16 behind the status bits",
     .default_value = 0,
     .choices = check_choices,
     .probeable = true},
    {.name = "ma_khz", .meaning = "clock, kHz", .default_value = 1000, .minimum = 10, .maximum = 10'000},
    {.name = "latency_us",
     .meaning = "the longest time until the position is ready, us: of the encoder, and of the line there and back",
     .default_value = 10'000,
     .minimum = 0,
     .maximum = 1'000'000,
     .decimals = 3},
    {.name = "line_delay_ns",
     .meaning = "virtual encoder: delay of the line, there and back",
     .default_value = 0,
     .minimum = 0,
     .maximum = 100'000},
    {.name = "ready_us",
     .meaning = "virtual encoder: the time that it needs itself, us; 0: as latency_us, but at most 10",
     .default_value = 0,
     .minimum = 0,
     .maximum = 1'000'000,
     .decimals = 3},
}};
static_assert(options[option_unit_um].name == "unit_um" && options[option_ready_us].name == "ready_us");

constexpr auto models =
    position_models<option_singleturn_bits, option_multiturn_bits, option_position_bits, option_unit_um>;

constexpr std::array<Command, 1> commands{{{"position", Verb::read, 0, "position, turns, error and warning"}}};

constexpr auto fields = joined_fields(word_fields, own_fields);

Behaviour behaviour_of(const Options& values) {
  const Time allowed = std::min(Time(values[option_latency_us]), Behaviour{}.latency);
  const Time ready(values[option_ready_us]);
  return {.latency = ready > Time{} ? ready : allowed, .line_delay = Time(values[option_line_delay_ns])};
}

Error decode_frame(const Options& values, Frame, Frame reply, FieldSink& sink) {
  const Format format = to_format(values);
  if (!is_usable(format.word)) return Error::invalid_argument;
  return decode(format, to_bits(reply), sink);
}

// The host sends nothing but clocks.
Result<std::size_t> encode_request(const Options&, const Command&, Arguments, MutableBytes) { return std::size_t{0}; }

// The pause of the clock ends a frame.
Delimit delimit(const Options&, Direction, Bytes bytes) { return {Delimit::Kind::complete, bytes.size()}; }

Any<Conversation> host(const Options& values, const Command&, Arguments, std::span<std::byte> storage) {
  const Format format = to_format(values);
  if (!is_usable(format.word) || !is_usable(format.scale)) return {};
  const Clocking clocking{.rate = static_cast<std::uint32_t>(values[option_ma_khz]) * 1000,
                          .latency = Time(values[option_latency_us])};
  return make_host<ReadPosition>(storage, format, clocking);
}

Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
  const Format format = to_format(values);
  if (!is_usable(format.word)) return {};
  return make_device<VirtualEncoder>(storage, format, shaft, behaviour_of(values));
}

Resolution resolution(const Options& values) {
  const Format format = to_format(values);
  return resolution_of(format.word, format.scale);
}

// Around the end of the idle line a flip only changes the length of the ACK. Within the ACK, and at the start bit, it
// moves the frame, which a CRC of 6 bits misses once in 64 times.
bool covered(const Options&, Frame, Frame reply, std::size_t bit) {
  const BitView samples = to_bits(reply);
  const std::size_t idle = samples[0] ? samples.end_of_run(0) : 0;
  return bit + 1 < idle || bit > samples.end_of_run(idle);
}

// Behind the start bit and CDS.
BitRanges place_of(const Options& values, Frame, Frame reply, const FieldInfo& field) {
  const BitView samples = to_bits(reply);
  const std::size_t start = samples.end_of_run(samples[0] ? samples.end_of_run(0) : 0);
  return place_in_word(to_format(values).word, field, start + 2);
}

}  // namespace

Format to_format(const Options& values) {
  return {.word = values.has_word() ? values.word : word_with_status(position_bits(values, option_singleturn_bits)),
          .check = static_cast<Check>(values[option_check]),
          .scale = scale_of(values, option_position_bits, option_unit_um)};
}

constinit const Unit unit{
    .id = "biss",
    .name = "BiSS-C (unidirectional)",
    .document = "RLS E201-9S Decoding the BiSS information",
    .link = LinkKind::clocked,
    .line = line_settings,
    .options = options,
    .models = models,
    .fields = fields,
    .commands = commands,
    .vectors = vectors,
    .status = nullptr,
    .alarms = &fields[word_field_alarms],
    .host_storage = sizeof(ReadPosition),
    .device_storage = sizeof(VirtualEncoder),
    .decode = decode_frame,
    .encode = encode_request,
    .delimit = delimit,
    .host = host,
    .device = device,
    .resolution = resolution,
    .covered = covered,
    .bits = place_of,
};

}  // namespace absenc::biss
