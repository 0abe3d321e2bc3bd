// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/unit.hpp"

#include <array>
#include <bit>
#include <optional>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/biss/fields.hpp"
#include "absenc/protocol/e201/device.hpp"
#include "absenc/protocol/e201/procedures.hpp"
#include "absenc/protocol/e201/vectors.hpp"

namespace absenc::e201 {

namespace {

using namespace author;

// ---- Options

/// Values of the unit's options.
struct Settings {
  std::uint8_t singleturn_bits = 0;
  std::uint8_t multiturn_bits = 0;
  bool multiturn_first = true;
  std::uint8_t position_bits = 0;
  std::int64_t unit_pm = 0;
  Carries carries = Carries::biss;
  bool gray = false;
  ssi::AfterWord after_word = ssi::AfterWord::repeat;
  Kind kind = Kind::other;
  std::int64_t latency_ns = 10'000;
  std::int64_t line_delay_ns = 0;
  unsigned firmware = 116;  // firmware version of the virtual interface in hundredths: 116 is 1.16
};

constexpr std::array<std::string_view, 2> carries_choices{"biss", "ssi"};
constexpr std::array<std::string_view, 2> kind_choices{"other", "resolute"};

constexpr auto options = OptionsOf{
    OptionOf<&Settings::singleturn_bits>{singleturn_bits_option},
    OptionOf<&Settings::multiturn_bits>{multiturn_bits_option},
    OptionOf<&Settings::multiturn_first>{multiturn_first_option},
    OptionOf<&Settings::position_bits>{position_bits_option},
    OptionOf<&Settings::unit_pm>{unit_um_option},
    option<&Settings::carries>("carries", "what the encoder speaks", carries_choices),
    describing_word(option<&Settings::gray>("gray", "SSI: turns and position are one Gray-coded number")),
    OptionOf<&Settings::after_word>{after_word_option},
    option<&Settings::kind>("encoder", "resolute: a Renishaw Resolute, for which 280 and 560 kHz are recommended",
                            kind_choices),
    decimal<3>(option<&Settings::latency_ns>("latency_us", "virtual encoder: time until its position is ready, us", 0,
                                             1'000'000)),
    option<&Settings::line_delay_ns>("line_delay_ns", "virtual encoder: delay of the line, there and back", 0, 100'000),
    decimal<2>(option<&Settings::firmware>("firmware", "virtual interface: version; reading needs 1.16", 0, 9999)),
};

constexpr WordFormat word_of(const Settings& given) {
  const PositionBits bits = given.position_bits != 0
                                ? PositionBits{.position = given.position_bits}
                                : PositionBits{given.singleturn_bits, given.multiturn_bits, given.multiturn_first};
  if (given.carries == Carries::biss) return biss::word_with_status(bits);
  return ssi::word_with(bits, given.gray, ssi::ErrorBit::none, Parity::none);
}

constexpr Format format_of(const Settings& given, const WordFormat* word) {
  return {.word = word != nullptr ? *word : word_of(given),
          // A word that the user gives is linear if the user also gives a unit of length.
          .scale = {.linear = (word != nullptr ? given.unit_pm : given.position_bits) != 0,
                    .unit_um = static_cast<double>(given.unit_pm) / 1e6},
          .carries = given.carries,
          .after_word = given.after_word,
          .kind = given.kind,
          .firmware = {given.firmware / 100, given.firmware % 100},
          .latency = Time(given.latency_ns),
          .line_delay = Time(given.line_delay_ns)};
}

// A word of 26 or 32 bits does not prove that the encoder is a Resolute, so the models of other encoders come first.
constexpr auto resolute_models = std::array{
    ModelText{"rotary-26", "single-turn, 26 bits", 0,
              "singleturn_bits=26 multiturn_bits=0 position_bits=0 encoder=other"},
    ModelText{"rotary-32", "single-turn, 32 bits", 0,
              "singleturn_bits=32 multiturn_bits=0 position_bits=0 encoder=other"},
    ModelText{"resolute-26", "Renishaw Resolute, 26 bits: MA at 280 or 560 kHz (M4, M5)", 0,
              "singleturn_bits=26 multiturn_bits=0 position_bits=0 encoder=resolute"},
    ModelText{"resolute-32", "Renishaw Resolute, 32 bits: MA at 280 or 560 kHz (M4, M5)", 0,
              "singleturn_bits=32 multiturn_bits=0 position_bits=0 encoder=resolute"},
};
constexpr auto models = [] {
  std::array<ModelText, position_models.size() + resolute_models.size()> all{};
  std::size_t count = 0;
  for (const ModelText& one : position_models) all[count++] = one;
  for (const ModelText& one : resolute_models) all[count++] = one;
  return all;
}();

// ---- Fields

template <auto member>
constexpr std::optional<AsciiText> text_of(const InterfaceResults& found) {
  return found.*member ? std::optional(AsciiText{*(found.*member)}) : std::nullopt;
}
template <std::uint8_t symbol>
constexpr std::optional<unsigned> milli(const InterfaceResults& found) {
  return found.supply ? find_milli(*found.supply, symbol) : std::nullopt;
}
constexpr std::optional<unsigned> frames(const InterfaceResults& found) {
  return found.frames != 0 ? std::optional(found.frames) : std::nullopt;
}
template <std::size_t i>
constexpr std::optional<unsigned> valid(const InterfaceResults& found) {
  return i < found.measured ? std::optional(found.valid[i]) : std::nullopt;
}
constexpr std::optional<std::int64_t> restored(const InterfaceResults& found) {
  return found.restored ? std::optional<std::int64_t>(found.previous) : std::nullopt;
}
constexpr std::optional<bool> aborted(const InterfaceResults& found) {
  return found.restored ? std::optional(found.aborted) : std::nullopt;
}
std::optional<std::int64_t> recommended(const InterfaceResults& found) {
  const unsigned clock = found.restored && !found.aborted ? found.recommended() : 0;
  return clock != 0 ? std::optional<std::int64_t>(clock) : std::nullopt;
}
constexpr std::optional<std::int64_t> set_clock_of(const InterfaceResults& found) { return found.clock; }
constexpr std::optional<std::int64_t> left(const InterfaceResults& found) { return found.left; }
template <auto clock>
constexpr std::optional<unsigned> khz(const InterfaceResults& found) {
  const std::optional<std::int64_t> one = clock(found);
  if (!one) return std::nullopt;
  return clocks_khz[static_cast<std::size_t>(*one) - 1];
}

constexpr auto own_fields = fields_of<InterfaceResults>(
    field<text_of<&InterfaceResults::command>>("command", "", "the request", Role::exchange),
    field<text_of<&InterfaceResults::version>>("version", "", "firmware of the interface", Role::identity),
    field<text_of<&InterfaceResults::serial>>("serial", "", "serial number of the interface", Role::identity),
    field<text_of<&InterfaceResults::supply>>("supply", "", "supply of the encoder, as the interface says it"),
    field<milli<'V'>>("supply_mv", "mV", "voltage in that text"),
    field<milli<'A'>>("supply_ma", "mA", "current in that text"),
    field<&InterfaceResults::clock>("clock", "", "setting of the MA clock, 1 to 8"),
    field<khz<set_clock_of>>("clock_khz", "kHz", "MA clock"),
    field<&InterfaceResults::advice>("advice", "",
                                     "the clocks that are recommended for this encoder, where another is set"),
    field<&InterfaceResults::width>("width", "bits", "width of the position that ? gives"),
    field<&InterfaceResults::counts>("counts", "counts", "position, the interface's zero taken off"),
    field<frames>("frames", "", "frames read at each clock"),
    field<valid<0>>("valid_35_khz", "", "good frames at 35 kHz"),
    field<valid<1>>("valid_70_khz", "", "good frames at 70 kHz"),
    field<valid<2>>("valid_140_khz", "", "good frames at 140 kHz"),
    field<valid<3>>("valid_280_khz", "", "good frames at 280 kHz"),
    field<valid<4>>("valid_560_khz", "", "good frames at 560 kHz"),
    field<valid<5>>("valid_1100_khz", "", "good frames at 1100 kHz"),
    field<valid<6>>("valid_2200_khz", "", "good frames at 2200 kHz"),
    field<valid<7>>("valid_4400_khz", "", "good frames at 4400 kHz"),
    field<recommended>("recommended_clock", "", "to be set with `absenc config set ... clock`"),
    field<khz<recommended>>("recommended_khz", "kHz", "that clock"),
    field<restored>("restored_clock", "", "clock before the sweep, which is restored"),
    field<aborted>("aborted", "", "the sweep was ended early: not all clocks were tried"));
// Fields that are reported after a clock sweep was interrupted.
constexpr auto left_fields = fields_of<InterfaceResults>(
    field<left>("left_clock", "", "the clock that the sweep set last"),
    field<khz<left>>("left_khz", "kHz", "that clock"),
    field<&InterfaceResults::previous>("previous_clock", "",
                                       "clock before the sweep: restore it with `absenc config set ... clock`"));
constexpr auto all_fields = joined(word_fields.infos, biss::frame_fields.infos, own_fields.infos, left_fields.infos);

constexpr void put_samples(FieldSink& sink, const Format& format, std::uint64_t samples) {
  const Position position = decode_position(format, samples).value();
  const bool is_biss = format.carries == Carries::biss;
  if (is_biss) biss::frame_fields.put<&biss::FrameValues::ack_bits>(sink, position.ack_bits);
  put_word(sink, format.word, position.word, format.scale);
  if (is_biss) biss::frame_fields.put<&biss::FrameValues::crc>(sink, position.crc);
}

// ---- Reported fields

constexpr void put_request(FieldSink& sink, const Format& format, const Request& request) {
  InterfaceResults found;
  found.command.emplace().append(trimmed(Protocol::encode(format, request)));
  own_fields.put(sink, found);
}
constexpr void put_reply(FieldSink& sink, const Format& format, const Request& request, const Reply& reply) {
  if (request.letter == letter::samples) return put_samples(sink, format, reply.samples);
  if (!letter::is_in(letter::answered_by_a_line, request.letter)) return put_request(sink, format, request);
  InterfaceResults found;
  found.take(request.letter, reply);
  own_fields.put(sink, found);
}
void put_found(FieldSink& sink, const Format& format, const InterfaceResults& found) {
  if (found.reading.singleturn_bits != 0) put_samples(sink, format, found.samples);
  own_fields.put(sink, found);
}
void put_left(FieldSink& sink, const Format&, const InterfaceResults& found) {
  if (found.left != 0) left_fields.put(sink, found);
}

constexpr Report<Protocol> report{
    .put_request = put_request,
    .put_reply = put_reply,
    .explain = explain,
    .noise_advice = check_stream,
};
constexpr Finding<Format, InterfaceResults> found{.put = put_found, .put_left = put_left};

// ---- Commands

// A linear encoder needs its unit of length, so that readings are not taken for angles.
constexpr bool is_readable(const Format& format) { return fits(format) && absenc::is_usable(format.scale); }

template <std::uint8_t one>
constexpr Request asks(const Format&) {
  return {one};
}
template <std::uint8_t one>
constexpr Request does(const Format&, Arguments) {
  return {one};
}
constexpr Request selects(const Format&, Arguments arguments) { return {letter::set_clock, clock_of(arguments[0])}; }
constexpr std::array<Argument, 1> clock_arguments{
    {{"clock", "1 to 8, or 35 70 140 280 560 1100 2200 4400 kHz", 1, 4400}}};
constexpr std::array<Argument, 1> sweep_arguments{{{"frames", "to read at each clock", 1, 1000, 20, false}}};
constexpr auto commands = std::array{
    command<report, found, read, does<letter::samples>>(
        {"position", Verb::read, 0, "position, turns, error and warning"})
        .only_if(is_readable),
    command<report, found, read_info, does<letter::version>>(
        {"info", Verb::info, 0, "version, serial number, supply and MA clock of the interface"}),
    reading<report, asks<letter::clock>>({"clock", Verb::config_get, 0, "MA clock"}),
    command<report, found, set_clock, selects>(
        {"set-clock", Verb::config_set, 0, "set the MA clock", clock_arguments, true, false, "clock"}),
    reading<report, asks<letter::width>>({"width", Verb::config_get, 0, "width of the position that ? gives"}),
    command<report, found, set_zero, does<letter::zero>>(
        {"set-zero", Verb::run, 0, "the interface's own zero: decimal counts from here", {}, true, false}),
    command<report, found, clear_zero, does<letter::clear_zero>>(
        {"clear-zero", Verb::run, 0, "clear that zero", {}, true, false}),
    reading<report, asks<letter::decimal>>({"decimal", Verb::read_part, 0, "position from that zero, by ?"}),
    command<report, found, switch_supply, does<letter::supply_on>, true>(
        {"supply-on", Verb::run, 0, "switch the encoder's supply on", {}, true, false}),
    command<report, found, switch_supply, does<letter::supply_off>, false>(
        {"supply-off", Verb::run, 0, "switch the encoder's supply off", {}, true, false}),
    reading<report, asks<letter::stream_off>>({"stream-off", Verb::run, 0, "end a stream of positions"}),
    command<report, found, sweep_clocks, does<letter::samples>>(
        {"clock-sweep", Verb::run, 0, "count the good frames at every MA clock and recommend one", sweep_arguments,
         false, false})
        .only_if(is_readable),
};

// ---- Declaration

constexpr Format format_by(const Options& values) {
  return format_of(options.format(values), values.has_word() ? &values.word : nullptr);
}
constexpr LineSettings line_of(const Format&) { return line_settings; }
constexpr Resolution resolution_by(const Format& format) { return resolution_of(format.word, format.scale); }
constexpr std::size_t size_of_reply(const Format&, Bytes begin) {
  const std::size_t end = end_of_first_line(begin);
  return end != 0 ? end : begin.size() + 1;
}
constexpr Result<Request> guess_request(const Format&, Bytes) { return Request{letter::samples}; }

// Returns whether the checks must detect a wrong bit. They need not in an SSI word, in the bits after the CRC, and in a
// digit that only changes between lower and upper case.
bool is_checked(const Options& values, Frame, Frame reply, std::size_t bit) {
  const Format f = format_by(values);
  const Result<std::uint64_t> samples = decode_samples(reply.bytes);
  if (!samples || f.carries == Carries::ssi) return false;
  const Position position = decode_position(f, *samples).value();
  const std::size_t character = bit / 8;
  if (character + 1 == samples_length) return true;
  const std::uint8_t right = reply.bytes[character];
  const int before = hex_digit(static_cast<char>(right));
  const int after = hex_digit(static_cast<char>(right ^ 1u << bit % 8));
  if (after < 0) return true;
  const auto changed = static_cast<unsigned>(before ^ after);
  if (changed == 0) return false;
  const std::size_t first_changed = character * 4 + static_cast<unsigned>(std::countl_zero(changed << 28));
  return first_changed < biss::idle_bits + position.ack_bits + 2 + biss::data_bits(f.biss());
}

std::uint32_t reportable_by(const Options& values) { return contents_of(format_by(values).word).reported; }

constexpr auto known_as = std::array<std::string_view, 3>{"RLS", "E201-9S", "Renishaw"};

constexpr Declaration<Protocol, VirtualInterface> declaration{
    .id = "e201",
    .name = "RLS E201-9S USB interface",
    .document = "RLS E201-9S Decoding the BiSS information",
    .known_as = known_as,
    .link = LinkKind::full_duplex,
    .options = options.infos,
    .format = format_by,
    .models = models,
    .fields = all_fields,
    .commands = commands,
    .vectors = vectors,
    .frames_are_texts = true,
    .frames_size = 1200,
    .report = report,
    .line = line_of,
    .resolution = resolution_by,
    .is_usable = fits,
    .guess_request = guess_request,
    .reply_size = size_of_reply,
    .is_checked = is_checked,
    .reportable = reportable_by,
    .alarms = word_fields.of<&WordValues::alarms>(),
    .timing = {.turnaround_limit = answer_limit},
};

}  // namespace

constinit const Unit unit = Descriptor<declaration>::make();

}  // namespace absenc::e201
