// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <optional>

#include "absenc/protocol/biss/commands.hpp"
#include "absenc/protocol/biss/compiled_format.hpp"
#include "absenc/protocol/biss/device.hpp"
#include "absenc/protocol/biss/fields.hpp"
#include "absenc/protocol/biss/unit.hpp"
#include "absenc/protocol/biss/vectors.hpp"
#include "absenc/protocol/word_options.hpp"

namespace absenc::biss {

namespace {

using namespace author;

struct SafetySettings : SafetyFormat, TimeoutSettings {
  std::uint8_t cpw_singleturn_bits = 24;
  std::uint8_t cpw_multiturn_bits = 0;
  std::uint8_t cpw_crc_width = crc6.width;
  std::uint16_t cpw_crc_poly = crc6.poly;
  std::uint16_t cpw_crc_init = crc6.init;
  bool cpw_crc_inverted = true;
  bool cpw_life_counter = false;
  std::uint8_t spw_singleturn_bits = 16;
  std::uint8_t spw_multiturn_bits = 0;
  std::uint8_t spw_crc_width = crc16.width;
  std::uint16_t spw_crc_poly = crc16.poly;
  std::uint16_t spw_crc_init = crc16.init;
  bool spw_crc_inverted = true;
  bool spw_life_counter = true;
};

struct SafetyWordValues {
  std::optional<std::uint64_t> multiturn{};
  std::uint64_t singleturn = 0;
  double angle = 0;
  bool error = false;
  bool warning = false;
  std::optional<unsigned> life_counter{};
  std::optional<unsigned> crc{};
};
struct SafetyAlarms {
  // alarms of the reading; the field is declared because of its flags, and its value is never put
  std::uint32_t alarms;
};

constexpr auto cpw_fields = fields_of<SafetyWordValues>(
    field<&SafetyWordValues::multiturn>("cpw_multiturn", "revolutions", "turns", Role::turns),
    field<&SafetyWordValues::singleturn>("cpw_singleturn", "counts", "position within the turn", Role::position),
    field<&SafetyWordValues::angle>("angle_deg", "deg", "position within the turn", Role::of_position),
    field<&SafetyWordValues::error>("cpw_error", "", "the encoder says that its position is wrong"),
    field<&SafetyWordValues::warning>("cpw_warning", "", "the encoder works near its limits"),
    field<&SafetyWordValues::life_counter>("cpw_life_counter", "", "counts up with every frame", Role::life_counter),
    field<&SafetyWordValues::crc>("cpw_crc", "", "as sent: inverted"));
constexpr auto spw_fields = fields_of<SafetyWordValues>(
    field<&SafetyWordValues::multiturn>("spw_multiturn", "revolutions", "turns of the safety word", Role::of_position),
    field<&SafetyWordValues::singleturn>("spw_singleturn", "counts", "position of the safety word", Role::of_position),
    field<&SafetyWordValues::error>("spw_error", "", "the safety word says that its position is wrong"),
    field<&SafetyWordValues::warning>("spw_warning", "", "the safety word warns"),
    field<&SafetyWordValues::life_counter>("spw_life_counter", "", "counts up with every frame, 63 and then 0",
                                           Role::life_counter),
    field<&SafetyWordValues::crc>("spw_crc", "", "as sent: inverted"));
constexpr auto alarm_fields =
    fields_of<SafetyAlarms>(field<&SafetyAlarms::alarms>("alarms", "error and warning of either word", word_flags));

constexpr SafetyWordValues values_of_word(const Channel& channel, const ChannelData& data) {
  SafetyWordValues values{.singleturn = data.word.position,
                          .angle = degrees(data.word.position, channel.word.bits_of(Meaning::position)),
                          .error = data.word.error,
                          .warning = data.word.warning};
  if (channel.word.find(Meaning::multiturn) != nullptr) values.multiturn = data.word.multiturn;
  if (channel.check.life_counter) values.life_counter = data.life_counter;
  if (channel.check.width != 0) values.crc = data.crc;
  return values;
}

constexpr auto safety_options = OptionsOf{
    probeable(option<&SafetySettings::cpw_singleturn_bits>("cpw_singleturn_bits", "control word: bits of the position",
                                                           1, 64)),
    probeable(
        option<&SafetySettings::cpw_multiturn_bits>("cpw_multiturn_bits", "control word: bits of the turns", 0, 63)),
    option<&SafetySettings::cpw_crc_width>("cpw_crc_width", "control word: bits of the CRC; 0: none", 0, 16),
    option<&SafetySettings::cpw_crc_poly>("cpw_crc_poly", "its polynomial without the highest power", 0, 0xFFFF),
    option<&SafetySettings::cpw_crc_init>("cpw_crc_init", "its start value", 0, 0xFFFF),
    option<&SafetySettings::cpw_crc_inverted>("cpw_crc_inverted", "whether it is sent inverted"),
    option<&SafetySettings::cpw_life_counter>("cpw_life_counter", "control word: 6 bits that count frames"),
    probeable(option<&SafetySettings::spw_singleturn_bits>("spw_singleturn_bits", "safety word: bits of the position",
                                                           1, 64)),
    probeable(
        option<&SafetySettings::spw_multiturn_bits>("spw_multiturn_bits", "safety word: bits of the turns", 0, 63)),
    option<&SafetySettings::spw_crc_width>("spw_crc_width", "safety word: bits of the CRC; 0: none", 0, 16),
    option<&SafetySettings::spw_crc_poly>("spw_crc_poly", "its polynomial without the highest power", 0, 0xFFFF),
    option<&SafetySettings::spw_crc_init>("spw_crc_init", "its start value", 0, 0xFFFF),
    option<&SafetySettings::spw_crc_inverted>("spw_crc_inverted", "whether it is sent inverted"),
    option<&SafetySettings::spw_life_counter>("spw_life_counter", "safety word: 6 bits that count frames"),
    option<&SafetySettings::compare_bits>(
        "compare_bits", "upper bits of the position in which both words agree within one count", 1, 64),
    option<&SafetySettings::previous_life_counter>(
        "previous_life_counter", "of the frame before the one that is decoded; -1: not known", -1, 63),
    clock_option<&SafetySettings::ma_khz>,
    decimal<3>(option<&SafetySettings::latency>("latency_us",
                                                "the longest time until the position is ready, us: of the encoder, and "
                                                "of the line there and back",
                                                0, 1'000'000)),
    line_delay_option<&SafetySettings::line_delay_ns>,
    option<&SafetySettings::slave>("slave", "whose registers are meant: the safety word is 0, the control word 1", 0,
                                   7),
    register_order_option<&SafetySettings::register_order>,
    register_delay_option<&SafetySettings::register_delay_us>,
    start_sequence_option<&SafetySettings::start_sequence>,
    timeout_option,
    adaptive_timeout_option,
    stop_bit_option<&SafetySettings::stop_bit>,
};
constexpr auto safety_models = std::array{
    ModelText{
        "RXH", "24 bits, safety word 16", 0,
        "cpw_singleturn_bits=24 cpw_multiturn_bits=0 spw_singleturn_bits=16 spw_multiturn_bits=0 compare_bits=13"},
    ModelText{"RXM", "16 bits, safety word 12", 0,
              "cpw_singleturn_bits=16 cpw_multiturn_bits=0 spw_singleturn_bits=12 spw_multiturn_bits=0 compare_bits=9"},
    ModelText{
        "RSH", "24 bits and turns, safety word 16 and turns", 0,
        "cpw_singleturn_bits=24 cpw_multiturn_bits=12 spw_singleturn_bits=16 spw_multiturn_bits=12 compare_bits=13"},
    ModelText{
        "RSM", "16 bits and turns, safety word 12 and turns", 0,
        "cpw_singleturn_bits=16 cpw_multiturn_bits=12 spw_singleturn_bits=12 spw_multiturn_bits=12 compare_bits=9"},
    ModelText{
        "RUH", "24 bits and turns, safety word 16", 0,
        "cpw_singleturn_bits=24 cpw_multiturn_bits=12 spw_singleturn_bits=16 spw_multiturn_bits=0 compare_bits=13"},
    ModelText{
        "RUM", "16 bits and turns, safety word 12", 0,
        "cpw_singleturn_bits=16 cpw_multiturn_bits=12 spw_singleturn_bits=12 spw_multiturn_bits=0 compare_bits=9"},
    ModelText{
        "RLM", "16 bits and 24 bits of turns, safety word 12 and turns", 0,
        "cpw_singleturn_bits=16 cpw_multiturn_bits=24 spw_singleturn_bits=12 spw_multiturn_bits=24 compare_bits=9"},
    ModelText{
        "RLH", "24 bits and 24 bits of turns, safety word 16 and turns", 0,
        "cpw_singleturn_bits=24 cpw_multiturn_bits=24 spw_singleturn_bits=16 spw_multiturn_bits=24 compare_bits=13"},
};
constexpr auto all_safety_fields =
    joined(cpw_fields.infos, spw_fields.infos, alarm_fields.infos, frame_fields.infos, register_fields.infos);

constexpr SafetyFormat safety_format(const Options& values) {
  SafetySettings given = safety_options.format(values);
  given.timeout = given.timeout_given();
  given.cpw = {
      word_with_status({given.cpw_singleturn_bits, given.cpw_multiturn_bits, true}),
      {given.cpw_crc_width, given.cpw_crc_poly, given.cpw_crc_init, given.cpw_crc_inverted, given.cpw_life_counter}};
  given.spw = {
      word_with_status({given.spw_singleturn_bits, given.spw_multiturn_bits, true}),
      {given.spw_crc_width, given.spw_crc_poly, given.spw_crc_init, given.spw_crc_inverted, given.spw_life_counter}};
  return given;
}
constexpr Resolution safety_resolution(const SafetyFormat& format) { return resolution_of(format.cpw.word, {}); }
constexpr bool is_safety_possible(const SafetyFormat& format) {
  return biss::is_usable(format) && absenc::is_usable(format.cpw.word) && absenc::is_usable(format.spw.word);
}

constexpr void put_safety_reply(FieldSink& sink, const SafetyFormat& format, const NoRequest&,
                                const SafetyReply& reply) {
  put_line_delay(sink, format, reply);
  frame_fields.put<&FrameValues::ack_bits>(sink, reply.ack_bits);
  cpw_fields.put(sink, values_of_word(format.cpw, reply.cpw));
  spw_fields.put(sink, values_of_word(format.spw, reply.spw));
}
Explanation explain_safety(const SafetyFormat& format, Error error, Bytes request, Bytes reply) {
  if (error == Error::sequence_mismatch) {
    return {"the life counter of the safety word did not go on by one: a frame was lost, or sent twice"};
  }
  if (error == Error::cross_check_failed) return {"control word and safety word show different positions"};
  return explain_frame(format, error, request, reply);
}

constexpr Report<ProtocolOf<SafetyFormat>> safety_report{.put_reply = put_safety_reply, .explain = explain_safety};
constexpr auto safety_commands = commands_of<safety_report, SafetyFormat>(is_safety_possible);

bool is_safety_checked(const Options& values, Frame, Frame reply, std::size_t bit) {
  const SafetyFormat made = safety_format(values);
  return made.cpw.check.width != 0 && made.spw.check.width != 0 && is_behind_ack(reply, bit);
}

constexpr auto safety_known_as = std::array<std::string_view, 2>{"iC-Haus", "Renishaw"};

constexpr Declaration<ProtocolOf<SafetyFormat>, VirtualEncoderOf<SafetyFormat>> safety_declaration{
    .id = "biss-safety",
    .name = "BiSS Safety",
    .document = "BiSS C Protocol Description rev D2, BiSS Safety",
    .known_as = safety_known_as,
    .link = LinkKind::clocked,
    .options = safety_options.infos,
    .format = safety_format,
    .models = safety_models,
    .fields = all_safety_fields,
    .commands = safety_commands,
    .vectors = safety_vectors,
    .frames_size = 2400,
    .report = safety_report,
    .line = line_of<SafetyFormat>,
    .resolution = safety_resolution,
    .is_usable = is_safety_possible,
    .decode_control = decode_control_frame,
    .encode = encode_control<SafetyFormat>,
    .is_checked = is_safety_checked,
    .control_bit = control_bit,
    .alarms = alarm_fields.of<&SafetyAlarms::alarms>(),
    .memory = registers::areas,
};

}  // namespace

constinit const Unit safety_unit = Descriptor<safety_declaration>::make();

}  // namespace absenc::biss
