// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/ssi/unit.hpp"

#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/ssi/compiled_format.hpp"
#include "absenc/protocol/ssi/device.hpp"
#include "absenc/protocol/ssi/host.hpp"
#include "absenc/protocol/ssi/vectors.hpp"
#include "absenc/protocol/word_options.hpp"

namespace absenc::ssi {

namespace {

using namespace author;

// Values of the option `parity`; `error`: even, and inverted if the position is wrong.
enum class WordParity : std::uint8_t { none, odd, even, error };

struct Settings : WordSettings<Format> {
  bool gray = false;
  ErrorBit error_bit = ErrorBit::none;
  WordParity parity = WordParity::none;
  unsigned tree_turns = 0;
  unsigned tree_steps = 0;
};
constexpr std::array<std::string_view, 3> error_bit_choices{"none", "active_high", "active_low"};
constexpr std::array<std::string_view, 4> parity_choices{"none", "odd", "even", "error"};

constexpr auto options = OptionsOf{
    OptionOf<&Settings::singleturn_bits>{{.name = "bits",
                                          .meaning = "bits of the position within the turn",
                                          .default_value = 12,
                                          .minimum = 1,
                                          .maximum = 64,
                                          .describes_word = true}},
    OptionOf<&Settings::multiturn_bits>{multiturn_bits_option},
    OptionOf<&Settings::multiturn_first>{multiturn_first_option},
    describing_word(option<&Settings::gray>("gray", "turns and position are one Gray-coded number")),
    describing_word(option<&Settings::error_bit>("error_bit", "a bit behind the position", error_bit_choices)),
    probeable(describing_word(option<&Settings::parity>(
        "parity", "the last bit, over all before it; error: even, and inverted when the position is wrong",
        parity_choices))),
    OptionOf<&Settings::after_word>{after_word_option},
    option<&Settings::extra_clocks>(
        "extra_clocks", "clocks behind the word, compared with after_word; as many as the word has bits read it twice",
        0, WordFormat::maximum_bits),
    describing_word(option<&Settings::tree_turns>(
        "tree_turns", "tree format: bits of the turns with the zeros before them; 0: another format", 0, 63)),
    describing_word(option<&Settings::tree_steps>(
        "tree_steps", "tree format: bits of the position with the zeros behind it; 0: another format", 0, 63)),
    option<&Settings::confirm_rpm>(
        "confirm_rpm", "the word is read once more: as fast as this may the shaft have moved; 0: it is read once", 0,
        100'000),
    OptionOf<&Settings::unit_pm>{unit_um_option},
    option<&Settings::clock_khz>("clock_khz", "clock, kHz", 1, 10'000),
    decimal<3>(option<&Settings::pause>(
        "pause_us", "the longest pause of the clock after which the old word still goes on (Tm), us", 0,
        1'000'000'000)),
    decimal<3>(option<&Settings::monoflop>(
        "monoflop_us", "virtual encoder: its monoflop time Tm, us, at most pause_us; 0: that", 0, 50'000)),
    option<&Settings::slowest_khz>("min_clock_khz", "virtual encoder: slowest clock that it allows", 1, 10'000),
    option<&Settings::fastest_khz>("max_clock_khz", "virtual encoder: fastest clock that it allows", 1, 10'000),
};
constexpr auto models = std::array{ModelText{"RAA38S6-12", "RAA38S6 with 12 bits, binary", 0,
                                             "bits=12 multiturn_bits=0 gray=false pause_us=500 monoflop_us=0"}};

constexpr Format format_by(const Options& values) {
  Settings given = options.format(values);
  const Parity parity = given.parity == WordParity::odd    ? Parity::odd
                        : given.parity == WordParity::none ? Parity::none
                                                           : Parity::even;
  const bool tree = given.tree_turns + given.tree_steps != 0;
  const WordFormat counts =
      tree ? tree_format(given.bits(), given.tree_turns, given.tree_steps) : word_format(given.bits());
  given.padded = tree;
  given.error_parity = given.parity == WordParity::error;
  return given.with_word(values, word_with(counts, given.gray, given.error_bit, parity), given.unit_pm != 0);
}
constexpr LineSettings line_of(const Format& format) {
  LineSettings settings = line_settings;
  settings.rate = format.clock_khz * 1000;
  return settings;
}
constexpr Resolution resolution_by(const Format& format) { return resolution_of(format.word, format.scale); }
constexpr bool is_possible(const Format& format) {
  return absenc::is_usable(format.word) && clocks(format) <= frame_capacity;
}

// ---- Reported fields

constexpr void put_reply(FieldSink& sink, const Format& format, const NoRequest&, const Word& word) {
  put_word(sink, format.word, word, format.scale);
  if (format.error_parity) word_fields.put<&WordValues::error>(sink, word.error);
}
Explanation explain(const Format& format, Error error, Bytes, Bytes) {
  if (error == Error::bad_checksum) return {"the parity of the word is wrong"};
  if (error == Error::out_of_range && format.padded) return {"what fills the word up is not zero"};
  if (error == Error::out_of_range) {
    return {"there are more clocks than the word has bits: read as one number they are larger than any position",
            "give as many bits as the word has, or set extra_clocks"};
  }
  if (error != Error::cross_check_failed) return {};
  if (format.confirm_rpm != 0) {
    return {"the word read once more is one that the shaft cannot have reached: the line is noisy, or broken"};
  }
  return {"the bits behind the word are not what after_word says: the number of bits may be wrong, or the line noisy"};
}

constexpr Report<Protocol> report{.put_reply = put_reply, .explain = explain};

// ---- Declaration

constexpr auto commands = std::array{
    clocked_reading<report>({"position", Verb::read, 0, "position and turns"})
        .or_when([](const Format& format) { return format.confirm_rpm != 0; },
                 clocked_reading<report, ConfirmPosition>({}))
        .only_if(is_possible),
};

// A word has no checksum and often no parity bit, so detection of a wrong bit is not demanded.
bool is_checked(const Options&, Frame, Frame, std::size_t) { return false; }
BitRanges bits_in(const Options& values, Frame, Frame, const FieldInfo& field) {
  return place_in_word(format_by(values).word, field, 0);
}

std::uint32_t reportable_by(const Options& values) {
  const Format format = format_by(values);
  return contents_of(format.word).reported | (format.error_parity ? word_error : 0);
}

constexpr Declaration<Protocol, VirtualEncoder> declaration{
    .id = "ssi",
    .name = "SSI",
    .document = "Absolute Encoder Operation Manual, RAA38S6 series",
    .link = LinkKind::clocked,
    .options = options.infos,
    .format = format_by,
    .models = models,
    .fields = word_fields.infos,
    .commands = commands,
    .vectors = vectors,
    .report = report,
    .line = line_of,
    .resolution = resolution_by,
    .is_usable = is_possible,
    .is_checked = is_checked,
    .bits = bits_in,
    .reportable = reportable_by,
    .alarms = word_fields.of<&WordValues::alarms>(),
};

}  // namespace

constinit const Unit unit = Descriptor<declaration>::make();

}  // namespace absenc::ssi
