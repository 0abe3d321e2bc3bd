// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <optional>
#include <tuple>
#include <utility>

#include "absenc/protocol/biss/commands.hpp"
#include "absenc/protocol/biss/device.hpp"
#include "absenc/protocol/biss/fields.hpp"
#include "absenc/protocol/biss/unit.hpp"
#include "absenc/protocol/biss/vectors.hpp"
#include "absenc/protocol/word_options.hpp"

namespace absenc::biss {

namespace {

using namespace author;

constexpr unsigned most = ChainFormat::most;

// Options that describe the position word in one channel of the chain.
template <unsigned>
struct ChannelSettings {
  std::uint8_t singleturn_bits = 19;
  std::uint8_t multiturn_bits = 0;
  std::uint8_t crc_width = crc6.width;
  std::uint16_t crc_poly = crc6.poly;
  std::uint16_t crc_init = crc6.init;
  bool crc_inverted = true;
  bool life_counter = false;

  [[nodiscard]] constexpr Channel channel() const {
    return {word_with_status({singleturn_bits, multiturn_bits, true}),
            {crc_width, crc_poly, crc_init, crc_inverted, life_counter}};
  }
};
template <class>
struct ChainSettingsOf;
template <std::size_t... channel>
struct ChainSettingsOf<std::index_sequence<channel...>> : ChainFormat, TimeoutSettings, ChannelSettings<channel>... {
  std::uint8_t slaves = 2;
  std::int64_t unit_pm = 0;

  // Sets the channels that are used: making a word takes time, and a search makes one for each set of options.
  constexpr void set_channels() {
    ((channel < slaves ? static_cast<void>(channels[channel] = ChannelSettings<channel>::channel()) : void()), ...);
  }
};
using EveryChannel = std::make_index_sequence<most>;
using ChainSettings = ChainSettingsOf<EveryChannel>;

// ---- Names with the channel number, such as channel0_crc_width

template <std::size_t size>
struct Text {
  std::array<char, size> characters{};
  consteval Text(const char (&text)[size]) {
    for (std::size_t i = 0; i < size; ++i) characters[i] = text[i];
  }
};

template <unsigned channel, Text text>
constexpr auto name_text = [] {
  constexpr std::string_view prefix = "channel0_";
  std::array<char, prefix.size() + text.characters.size() - 1> made{};
  for (std::size_t i = 0; i < prefix.size(); ++i) made[i] = prefix[i];
  made[prefix.size() - 1 - 1] = static_cast<char>('0' + channel);
  for (std::size_t i = 0; i + 1 < text.characters.size(); ++i) made[prefix.size() + i] = text.characters[i];
  return made;
}();
template <unsigned channel, Text text>
constexpr std::string_view name_of{name_text<channel, text>.data(), name_text<channel, text>.size()};

template <unsigned i>
constexpr auto channel_options() {
  using Of = ChannelSettings<i>;
  return std::tuple{
      describing_word(option<&Of::singleturn_bits>(name_of<i, "singleturn_bits">, "bits of the position", 1, 64)),
      describing_word(
          option<&Of::multiturn_bits>(name_of<i, "multiturn_bits">, "bits of the turns; 0: no turns", 0, 63)),
      option<&Of::crc_width>(name_of<i, "crc_width">, "bits of the CRC; 0: there is none", 0, 16),
      option<&Of::crc_poly>(name_of<i, "crc_poly">, "its polynomial without the highest power", 0, 0xFFFF),
      option<&Of::crc_init>(name_of<i, "crc_init">, "its start value", 0, 0xFFFF),
      option<&Of::crc_inverted>(name_of<i, "crc_inverted">, "whether it is sent inverted"),
      option<&Of::life_counter>(name_of<i, "life_counter">, "6 bits before the CRC that count frames"),
  };
}

template <std::size_t... channel>
constexpr auto options_of_channels(std::index_sequence<channel...>) {
  return std::tuple_cat(channel_options<channel>()...);
}

constexpr auto chain_options = std::apply(
    [](const auto&... all) { return OptionsOf{all...}; },
    std::tuple_cat(
        std::tuple{
            option<&ChainSettings::slaves>("slaves", "how many encoders are in the chain", 1, most),
            option<&ChainSettings::slave>(
                "slave", "whose position is read, and whose registers: 0 is at the end of the line, its word the last",
                0, most - 1),
            OptionOf<&ChainSettings::unit_pm>{unit_um_option},
            clock_option<&ChainSettings::ma_khz>,
            decimal<3>(option<&ChainSettings::latency>(
                "latency_us",
                "the longest time until the positions are ready, us: of the encoders, and of the line there and back",
                0, 1'000'000)),
            line_delay_option<&ChainSettings::line_delay_ns>,
            register_order_option<&ChainSettings::register_order>,
            register_delay_option<&ChainSettings::register_delay_us>,
            start_sequence_option<&ChainSettings::start_sequence>,
            timeout_option,
            adaptive_timeout_option,
            stop_bit_option<&ChainSettings::stop_bit>,
        },
        options_of_channels(EveryChannel{})));

// ---- Fields of each channel; the shown slave also has the fields of a single word

struct ChannelValues {
  std::optional<std::uint64_t> multiturn{};
  std::uint64_t singleturn = 0;
  bool error = false;
  bool warning = false;
  std::optional<unsigned> life_counter{};
  std::optional<unsigned> crc{};
};

template <std::size_t i>
constexpr auto fields_of_channel = fields_of<ChannelValues>(
    field<&ChannelValues::multiturn>(name_of<i, "multiturn">, "revolutions", "its turns", Role::of_position),
    field<&ChannelValues::singleturn>(name_of<i, "singleturn">, "counts", "its position", Role::of_position),
    field<&ChannelValues::error>(name_of<i, "error">, "", "it says that its position is wrong"),
    field<&ChannelValues::warning>(name_of<i, "warning">, "", "it works near its limits"),
    field<&ChannelValues::life_counter>(name_of<i, "life_counter">, "", "counts up with every frame",
                                        Role::life_counter),
    field<&ChannelValues::crc>(name_of<i, "crc">, "", "as sent"));
constexpr auto channel_fields = []<std::size_t... channel>(std::index_sequence<channel...>) {
  return std::array{fields_of_channel<channel>...};
}
(EveryChannel{});

constexpr ChannelValues values_of_channel(const Channel& channel, const ChannelData& data) {
  ChannelValues values{.singleturn = data.word.position, .error = data.word.error, .warning = data.word.warning};
  if (channel.word.find(Meaning::multiturn) != nullptr) values.multiturn = data.word.multiturn;
  if (channel.check.life_counter) values.life_counter = data.life_counter;
  if (channel.check.width != 0) values.crc = data.crc;
  return values;
}

constexpr auto chain_models = std::array{ModelText{"two-19", "two encoders of 19 bits", 0, "slaves=2"}};
constexpr auto all_chain_fields = []<std::size_t... channel>(std::index_sequence<channel...>) {
  return joined(word_fields.infos, fields_of_channel<channel>.infos..., frame_fields.infos, register_fields.infos);
}
(EveryChannel{});

constexpr ChainFormat chain_format(const Options& values) {
  ChainSettings given = chain_options.format(values);
  given.count = given.slaves;
  given.timeout = given.timeout_given();
  given.set_channels();
  if (values.has_word()) {
    for (Channel& channel : given.channels) channel.word = values.word;
    given.scale = {.linear = given.unit_pm != 0, .unit_um = static_cast<double>(given.unit_pm) / 1e6};
  }
  return given;
}
constexpr Resolution chain_resolution(const ChainFormat& format) {
  return resolution_of(format.channels[format.shown()].word, format.scale);
}
constexpr bool is_chain_possible(const ChainFormat& format) { return biss::is_usable(format); }

constexpr void put_chain_reply(FieldSink& sink, const ChainFormat& format, const NoRequest&, const ChainReply& reply) {
  put_line_delay(sink, format, reply);
  frame_fields.put<&FrameValues::ack_bits>(sink, reply.ack_bits);
  for (unsigned i = 0; i < format.count; ++i) {
    channel_fields[i].put(sink, values_of_channel(format.channels[i], reply.channels[i]));
  }
  const unsigned shown = format.shown();
  put_word(sink, format.channels[shown].word, reply.channels[shown].word, format.scale);
}

constexpr Report<ProtocolOf<ChainFormat>> chain_report{.put_reply = put_chain_reply,
                                                       .explain = explain_frame<ChainFormat>};
constexpr auto chain_commands = commands_of<chain_report, ChainFormat>(is_chain_possible);

bool is_chain_checked(const Options& values, Frame, Frame reply, std::size_t bit) {
  const ChainFormat made = chain_format(values);
  for (unsigned i = 0; i < made.count; ++i) {
    if (made.channels[i].check.width == 0) return false;
  }
  return is_behind_ack(reply, bit);
}

constexpr Declaration<ProtocolOf<ChainFormat>, VirtualEncoderOf<ChainFormat>> chain_declaration{
    .id = "biss-chain",
    .name = "BiSS-C, several encoders in a chain",
    .document = "BiSS C Protocol Description rev D2",
    .link = LinkKind::clocked,
    .options = chain_options.infos,
    .format = chain_format,
    .models = chain_models,
    .fields = all_chain_fields,
    .commands = chain_commands,
    .vectors = chain_vectors,
    .frames_size = 6400,
    .report = chain_report,
    .line = line_of<ChainFormat>,
    .resolution = chain_resolution,
    .is_usable = is_chain_possible,
    .decode_control = decode_control_frame,
    .encode = encode_control<ChainFormat>,
    .is_checked = is_chain_checked,
    .control_bit = control_bit,
    .alarms = word_fields.of<&WordValues::alarms>(),
    .memory = registers::areas,
};

}  // namespace

constinit const Unit chain_unit = Descriptor<chain_declaration>::make();

}  // namespace absenc::biss
