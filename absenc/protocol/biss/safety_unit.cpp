// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "absenc/protocol/biss/commands.hpp"
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

enum SafetyField : std::size_t {
  field_cpw_multiturn,
  field_cpw_singleturn,
  field_angle,
  field_cpw_error,
  field_cpw_warning,
  field_cpw_life_counter,
  field_cpw_crc,
  field_spw_multiturn,
  field_spw_singleturn,
  field_spw_error,
  field_spw_warning,
  field_spw_life_counter,
  field_spw_crc,
  field_alarms,
};

using Kind = FieldInfo::Kind;
constexpr std::array<FieldInfo, 14> safety_fields{{
    {"cpw_multiturn", Kind::counts, "revolutions", "turns", {}, Role::turns},
    {"cpw_singleturn", Kind::counts, "counts", "position within the turn", {}, Role::position},
    {"angle_deg", Kind::real, "deg", "position within the turn", {}, Role::of_position},
    {"cpw_error", Kind::boolean, "", "the encoder says that its position is wrong"},
    {"cpw_warning", Kind::boolean, "", "the encoder works near its limits"},
    {"cpw_life_counter", Kind::number, "", "counts up with every frame", {}, Role::life_counter},
    {"cpw_crc", Kind::number, "", "as sent: inverted"},
    {"spw_multiturn", Kind::counts, "revolutions", "turns of the safety word", {}, Role::of_position},
    {"spw_singleturn", Kind::counts, "counts", "position of the safety word", {}, Role::of_position},
    {"spw_error", Kind::boolean, "", "the safety word says that its position is wrong"},
    {"spw_warning", Kind::boolean, "", "the safety word warns"},
    {"spw_life_counter", Kind::number, "", "counts up with every frame, 63 and then 0", {}, Role::life_counter},
    {"spw_crc", Kind::number, "", "as sent: inverted"},
    {"alarms", Kind::flags, "", "error and warning of either word", word_flags},
}};

constexpr void put_word_of(FieldSink& sink, const Channel& channel, const ChannelData& data, bool safety) {
  const auto put = [&sink, safety](SafetyField cpw, SafetyField spw, std::uint64_t value) {
    sink.put({&safety_fields[safety ? spw : cpw], static_cast<std::int64_t>(value)});
  };
  const unsigned bits = channel.word.bits_of(Meaning::position);
  if (channel.word.find(Meaning::multiturn) != nullptr) {
    put(field_cpw_multiturn, field_spw_multiturn, data.word.multiturn);
  }
  put(field_cpw_singleturn, field_spw_singleturn, data.word.position);
  if (!safety) sink.put({&safety_fields[field_angle], 0, degrees(data.word.position, bits)});
  put(field_cpw_error, field_spw_error, data.word.error ? 1 : 0);
  put(field_cpw_warning, field_spw_warning, data.word.warning ? 1 : 0);
  if (channel.check.life_counter) put(field_cpw_life_counter, field_spw_life_counter, data.life_counter);
  if (channel.check.width != 0) put(field_cpw_crc, field_spw_crc, data.crc);
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
constexpr auto all_safety_fields = joined_fields(joined_fields(safety_fields, own_fields), register_fields.infos);

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
  sink.put({&own_fields[field_ack_bits], reply.ack_bits});
  put_word_of(sink, format.cpw, reply.cpw, false);
  put_word_of(sink, format.spw, reply.spw, true);
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
    .decode = decode_frame<safety_report, is_safety_possible, SafetyFormat>,
    .encode = encode_control<SafetyFormat>,
    .is_checked = is_safety_checked,
    .control_bit = control_bit,
    .alarms = &safety_fields[field_alarms],
    .memory = registers::areas,
};

}  // namespace

constinit const Unit safety_unit = Descriptor<safety_declaration>::make();

}  // namespace absenc::biss
