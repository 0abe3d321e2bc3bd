// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/ssi/unit.hpp"

#include <array>

#include "absenc/protocol/make.hpp"
#include "absenc/protocol/ssi/device.hpp"
#include "absenc/protocol/ssi/fields.hpp"
#include "absenc/protocol/ssi/host.hpp"
#include "absenc/protocol/ssi/vectors.hpp"
#include "absenc/protocol/word_options.hpp"

namespace absenc::ssi {

namespace {

constexpr std::array<std::string_view, 3> error_bit_choices{"none", "active_high", "active_low"};
constexpr std::array<std::string_view, 3> parity_choices{"none", "odd", "even"};

constexpr std::array<Option, 13> options{{
    {.name = "bits",
     .meaning = "bits of the position within the turn",
     .default_value = 12,
     .minimum = 1,
     .maximum = 64,
     .describes_word = true},
    multiturn_bits_option,
    multiturn_first_option,
    {.name = "gray",
     .meaning = "turns and position are one Gray-coded number",
     .default_value = 0,
     .choices = boolean_choices,
     .describes_word = true},
    {.name = "error_bit",
     .meaning = "a bit behind the position",
     .default_value = 0,
     .choices = error_bit_choices,
     .describes_word = true},
    {.name = "parity",
     .meaning = "the last bit, over all before it",
     .default_value = 0,
     .choices = parity_choices,
     .probeable = true,
     .describes_word = true},
    after_word_option,
    {.name = "extra_clocks",
     .meaning = "clocks behind the word, compared with after_word; as many as the word has bits read it twice",
     .default_value = 0,
     .minimum = 0,
     .maximum = WordFormat::maximum_bits},
    unit_um_option,
    {.name = "clock_khz", .meaning = "clock, kHz", .default_value = 200, .minimum = 1, .maximum = 10'000},
    {.name = "pause_us",
     .meaning = "Tm, the longest pause of the clock after which the old word still goes on, us",
     .default_value = 500'000,
     .minimum = 0,
     .maximum = 1'000'000'000,
     .decimals = 3},
    {.name = "min_clock_khz",
     .meaning = "virtual encoder: slowest clock that it allows",
     .default_value = 100,
     .minimum = 1,
     .maximum = 10'000},
    {.name = "max_clock_khz",
     .meaning = "virtual encoder: fastest clock that it allows",
     .default_value = 250,
     .minimum = 1,
     .maximum = 10'000},
}};
static_assert(options[option_unit_um].name == "unit_um" && options[option_max_clock_khz].name == "max_clock_khz");

constexpr std::array<OptionValue, 3> raa38s6_12{{{option_bits, 12}, {option_multiturn_bits, 0}, {option_gray, 0}}};
constexpr std::array<Model, 1> models{{{"RAA38S6-12", "RAA38S6 with 12 bits, binary", 0, raa38s6_12}}};

constexpr std::array<Command, 1> commands{{{"position", Verb::read, 0, "position and turns"}}};

bool is_usable(const Format& format) { return absenc::is_usable(format.word) && clocks(format) <= frame_capacity; }

std::uint32_t rate_of(const Options& values, OptionIndex khz) { return static_cast<std::uint32_t>(values[khz]) * 1000; }

LineSettings settings(const Options& values) {
  LineSettings line = line_settings;
  line.rate = rate_of(values, option_clock_khz);
  return line;
}

Timing timing_of(const Options& values) {
  return {.pause = Time(values[option_pause_us]),
          .shortest_period = LineSettings{.rate = rate_of(values, option_max_clock_khz)}.bits(1),
          .longest_period = LineSettings{.rate = rate_of(values, option_min_clock_khz)}.bits(1)};
}

Error decode_frame(const Options& values, Frame, Frame reply, FieldSink& sink) {
  const Format format = to_format(values);
  if (!is_usable(format)) return Error::invalid_argument;
  return decode(format, to_bits(reply), sink);
}

// The host sends nothing but clocks.
Result<std::size_t> encode_request(const Options&, const Command&, Arguments, MutableBytes) { return std::size_t{0}; }

// The pause of the clock ends a word.
Delimit delimit(const Options&, Direction, Bytes bytes) { return {Delimit::Kind::complete, bytes.size()}; }

Any<Conversation> host(const Options& values, const Command&, Arguments, std::span<std::byte> storage) {
  const Format format = to_format(values);
  if (!is_usable(format)) return {};
  return make_host<ReadPosition>(storage, format, Time(values[option_pause_us]));
}

Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
  const Format format = to_format(values);
  if (!is_usable(format)) return {};
  return make_device<VirtualEncoder>(storage, format, shaft, timing_of(values));
}

Resolution resolution(const Options& values) {
  const Format format = to_format(values);
  return resolution_of(format.word, format.scale);
}

// SSI has no checksum.
bool covered(const Options&, Frame, Frame, std::size_t) { return false; }

BitRanges place_of(const Options& values, Frame, Frame, const FieldInfo& field) {
  return place_in_word(to_format(values).word, field, 0);
}

WordFormat word_of_options(const Options& values) {
  const PositionBits bits{.position = static_cast<unsigned>(values[option_bits]),
                          .multiturn = static_cast<unsigned>(values[option_multiturn_bits]),
                          .multiturn_first = values[option_multiturn_first] != 0};
  return word_with(bits, values[option_gray] != 0, static_cast<ErrorBit>(values[option_error_bit]),
                   static_cast<Parity>(values[option_parity]));
}

}  // namespace

Format to_format(const Options& values) {
  return {.word = values.has_word() ? values.word : word_of_options(values),
          .after_word = static_cast<AfterWord>(values[option_after_word]),
          .extra_clocks = static_cast<unsigned>(values[option_extra_clocks]),
          .scale = scale_of(values, option_unit_um, option_unit_um)};
}

constinit const Unit unit{
    .id = "ssi",
    .name = "SSI",
    .document = "RAA38S6 manual, 3.5 SSI",
    .link = LinkKind::clocked,
    .line = line_settings,
    .options = options,
    .models = models,
    .fields = word_fields,
    .commands = commands,
    .vectors = vectors,
    .status = nullptr,
    .alarms = &word_fields[word_field_alarms],
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
    .settings = settings,
};

}  // namespace absenc::ssi
