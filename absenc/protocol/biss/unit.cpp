// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/unit.hpp"

#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/biss/commands.hpp"
#include "absenc/protocol/biss/compiled_format.hpp"
#include "absenc/protocol/biss/device.hpp"
#include "absenc/protocol/biss/fields.hpp"
#include "absenc/protocol/biss/host.hpp"
#include "absenc/protocol/biss/vectors.hpp"
#include "absenc/protocol/word_options.hpp"

namespace absenc::biss {

namespace {

using namespace author;

// The members of Check are repeated here, because each of them is an option.
struct Settings : WordSettings<Format>, TimeoutSettings {
  std::uint8_t crc_width = crc6.width;
  std::uint16_t crc_poly = crc6.poly;
  std::uint16_t crc_init = crc6.init;
  bool crc_inverted = crc6.inverted;
  bool life_counter = crc6.life_counter;
};

constexpr auto options = OptionsOf{
    OptionOf<&Settings::singleturn_bits>{singleturn_bits_option},
    OptionOf<&Settings::multiturn_bits>{multiturn_bits_option},
    OptionOf<&Settings::multiturn_first>{multiturn_first_option},
    OptionOf<&Settings::position_bits>{position_bits_option},
    OptionOf<&Settings::unit_pm>{unit_um_option},
    with_role<Role::check_width>(
        probeable(option<&Settings::crc_width>("crc_width", "bits of the CRC; 0: there is none", 0, 16))),
    with_role<Role::check_polynomial>(probeable(
        option<&Settings::crc_poly>("crc_poly", "its polynomial without the highest power: 0x3 is 0x43", 0, 0xFFFF))),
    with_role<Role::check_init>(option<&Settings::crc_init>("crc_init", "its start value", 0, 0xFFFF)),
    with_role<Role::check_inverted>(option<&Settings::crc_inverted>("crc_inverted", "whether it is sent inverted")),
    option<&Settings::life_counter>("life_counter", "6 bits between status bits and CRC that count frames"),
    clock_option<&Settings::ma_khz>,
    decimal<3>(option<&Settings::latency>(
        "latency_us",
        "the longest time until the position is ready, us: of the encoder, and of the line there and back", 0,
        1'000'000)),
    line_delay_option<&Settings::line_delay_ns>,
    decimal<3>(option<&Settings::ready>(
        "ready_us", "virtual encoder: the time that it needs itself, us; 0: as latency_us, but at most 10", 0,
        1'000'000)),
    option<&Settings::slave>("slave", "whose registers are meant: 0 is the encoder at the end of the line", 0, 7),
    register_order_option<&Settings::register_order>,
    register_delay_option<&Settings::register_delay_us>,
    start_sequence_option<&Settings::start_sequence>,
    timeout_option,
    adaptive_timeout_option,
    stop_bit_option<&Settings::stop_bit>,
};
constexpr auto all_fields = joined(word_fields.infos, frame_fields.infos, register_fields.infos);

constexpr Format format_by(const Options& values) {
  Settings given = options.format(values);
  given.check = {given.crc_width, given.crc_poly, given.crc_init, given.crc_inverted, given.life_counter};
  given.timeout = given.timeout_given();
  return given.with_word(values, word_with_status(given.bits()), given.position_bits != 0);
}
constexpr Resolution resolution_by(const Format& format) { return resolution_of(format.word, format.scale); }
constexpr bool is_possible(const Format& format) {
  return absenc::is_usable(format.word) && biss::is_usable(format.check);
}
constexpr bool is_readable(const Format& format) { return is_possible(format) && absenc::is_usable(format.scale); }

// Puts the fields of a reply into `sink`, in the order of the line.
constexpr void put_reply(FieldSink& sink, const Format& format, const NoRequest&, const Reply& reply) {
  put_line_delay(sink, format, reply);
  frame_fields.put<&FrameValues::ack_bits>(sink, reply.ack_bits);
  put_word(sink, format.word, reply.word, format.scale);
  if (format.check.life_counter) frame_fields.put<&FrameValues::life_counter>(sink, reply.life_counter);
  if (format.check.width != 0) frame_fields.put<&FrameValues::crc>(sink, reply.crc);
}

constexpr Report<Protocol> report{.put_reply = put_reply, .explain = explain_frame<Format>};
constexpr auto commands = commands_of<report, Format>(is_readable);

bool is_checked(const Options& values, Frame, Frame reply, std::size_t bit) {
  return format_by(values).check.width != 0 && is_behind_ack(reply, bit);
}
// Returns the bits of a field in the samples; the word begins after start bit and CDS.
BitRanges bits_in(const Options& values, Frame, Frame reply, const FieldInfo& field) {
  const BitView samples = to_bits(reply);
  const std::size_t start = samples.end_of_run(samples[0] ? samples.end_of_run(0) : 0);
  return place_in_word(format_by(values).word, field, start + 2);
}

std::uint32_t reportable_by(const Options& values) { return contents_of(format_by(values).word).reported; }

constexpr auto known_as = std::array<std::string_view, 3>{"iC-Haus", "RLS", "Renishaw"};

constexpr Declaration<Protocol, VirtualEncoderOf<Format>> declaration{
    .id = "biss",
    .name = "BiSS-C",
    .document = "RLS E201-9S Decoding the BiSS information",
    .known_as = known_as,
    .link = LinkKind::clocked,
    .options = options.infos,
    .format = format_by,
    .models = position_models,
    .fields = all_fields,
    .commands = commands,
    .vectors = vectors,
    .frames_size = 2400,
    .report = report,
    .line = line_of<Format>,
    .resolution = resolution_by,
    .is_usable = is_possible,
    .decode_control = decode_control_frame,
    .encode = encode_control<Format>,
    .is_checked = is_checked,
    .bits = bits_in,
    .control_bit = control_bit,
    .reportable = reportable_by,
    .alarms = word_fields.of<&WordValues::alarms>(),
    .memory = registers::areas,
};

}  // namespace

constinit const Unit unit = Descriptor<declaration>::make();

}  // namespace absenc::biss
