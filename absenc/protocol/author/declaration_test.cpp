// SPDX-License-Identifier: Apache-2.0
// Tests that the members of a Declaration reach the Unit.
#include "absenc/protocol/author/declaration.hpp"

#include <gtest/gtest.h>

#include <array>

#include "absenc/protocol/author/unit.hpp"

namespace absenc::author {
namespace {

using namespace std::chrono_literals;

// A protocol whose reply is one byte: that of the request plus one.
struct Toy {
  struct Format {
    unsigned bits = 8;
    [[nodiscard]] constexpr LineSettings line() const { return {.rate = 1000 * bits}; }
    [[nodiscard]] constexpr Resolution resolution() const { return {.singleturn_bits = bits}; }
  };
  using Request = std::uint8_t;
  using Reply = std::uint8_t;
  static constexpr std::size_t longest_reply = 1;
  static constexpr HostTimes host_times(const Format&) { return {.answer_limit = 1ms, .gap_limit = 1ms}; }
  static constexpr Manner manner(const Format&, const Request& request) {
    return {.pause = 3ms, .expects_reply = request != 0x7F};
  }
  static constexpr ByteBuffer<1> encode(const Format&, const Request& request) {
    ByteBuffer<1> bytes;
    bytes.push_back(request);
    return bytes;
  }
  static constexpr std::size_t request_size(const Format&, Bytes) { return 1; }
  static constexpr Result<Request> decode_request(const Format&, Bytes bytes) {
    return bytes[0] < 0x80 ? Result<Request>(bytes[0]) : Error::bad_framing;
  }
  static constexpr std::size_t reply_size(const Format&, const Request&) { return 1; }
  static constexpr std::size_t expected(const Format&, const Request&, Bytes) { return 1; }
  static constexpr ByteBuffer<1> encode_reply(const Format& format, const Request&, const Reply& reply) {
    return encode(format, reply);
  }
  static constexpr Result<Reply> decode(const Format&, const Request& request, Bytes bytes) {
    return bytes[0] == request + 1 ? Result<Reply>(bytes[0]) : Error::bad_checksum;
  }
  static constexpr bool is_whole(const Format&, Error) { return false; }
  static constexpr Reading reading(const Format&, const Request&, const Reply&) { return {}; }
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }
  static constexpr DeviceTimes device_times(const Format& format) {
    return {.character = format.line().byte_time(), .answer_time = 1us};
  }
};
using Format = Toy::Format;

class Encoder final : public BusDevice<Toy, Encoder, 1> {
 public:
  using BusDevice::BusDevice;
  [[nodiscard]] bool is_mine(const std::uint8_t&) const { return true; }
  std::optional<std::uint8_t> answer(const std::uint8_t& asked, Time) { return static_cast<std::uint8_t>(asked + 1); }
};

struct Values {
  std::optional<std::uint16_t> request{};
  std::optional<std::uint16_t> reply{};
};
constexpr auto options = OptionsOf{option<&Format::bits>("bits", "of the position", 1, 16)};
constexpr auto fields =
    fields_of<Values>(field<&Values::request>("request", "", "sent"), field<&Values::reply>("reply", "", "received"));
constexpr auto models = std::array{ModelText{"wide", "16 bits", 100, "bits=16"}};
constexpr Values values_of_request(const Format&, const std::uint8_t& request) { return {.request = request}; }
constexpr Values values_of_reply(const Format&, const std::uint8_t& request, const std::uint8_t& reply) {
  return {.request = request, .reply = reply};
}
constexpr Report<Toy> report{
    .put_request = put_values<fields, values_of_request>,
    .put_reply = put_values<fields, values_of_reply>,
    .explain = [](const Format&, Error, Bytes, Bytes) -> Explanation {
      return {"explained", "advised"};
    },
};
constexpr std::uint8_t ask(const Format&) { return 5; }
constexpr auto commands = std::array{reading<report, ask>({"position", Verb::read, 0, "position"})};
constexpr auto vectors = std::array{VectorText{"toy-1", "a reply", "invented", "", "05", "06", "request=5 reply=6"},
                                    VectorText{"toy-2", "another", "invented", "", "05", "07", "bad_checksum"}};
constexpr VectorParts quoted{{"id", "meaning", "source", "", "", "", "serial=\"0815\" count=7 name=SKM36 empty=\"\""},
                             false};
static_assert(quoted.fields[0].text == "0815" && quoted.fields[0].number == 0, "quoted digits are a text");
static_assert(quoted.fields[1].number == 7 && quoted.fields[2].text == "SKM36" && quoted.fields[3].text.empty());
constexpr Result<std::uint8_t> guess_request(const Format&, Bytes reply) {
  return static_cast<std::uint8_t>(reply[0] - 1);
}

constexpr auto known_as = std::array<std::string_view, 1>{"maker"};
constexpr Declaration<Toy, Encoder> smallest{
    .id = "smallest",
    .name = "toy",
    .document = "none",
    .known_as = known_as,
    .lookalikes = "any other toy",
    .link = LinkKind::half_duplex,
    .options = options.infos,
    .format = format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .report = report,
    .guess_request = guess_request,
};
constinit const Unit unit = Descriptor<smallest>::make();

FrameEnd end_of_frame(const Options&, Direction, Bytes) { return {FrameEnd::Kind::no_frame, 77}; }
bool is_answered(const Options&, Frame) { return true; }
bool is_checked(const Options&, Frame, Frame, std::size_t) { return false; }
BitRanges bits_in(const Options&, Frame, Frame, const FieldInfo&) { return {}; }
BitRanges host_bits(const Options&, Frame) { return {}; }
bool probe(Options&, std::span<const Capture>, EvidenceSink&) { return true; }
bool streams(const Options&) { return true; }
ExtraWires wires(const Options&) { return {}; }
std::optional<std::size_t> control_bit(const Options&, Frame) { return 7; }
Reading remembered(const Reading& before, Reading) { return before; }
Options learned(const Options& known, const Reading&) { return known; }
Follower* follower(const Options&, std::span<std::byte>) { return nullptr; }
constexpr std::array<MemoryArea, 1> memory{{{0, 0, 1, "a byte"}}};
constexpr std::array<RegisterInfo, 1> registers{{{"one", 1, 2}}};
constexpr std::array<Condition, 1> conditions{{{"battery", "", "there", 0, 1, 1}}};
constexpr auto text_vectors =
    std::array{VectorText{"toy-1", "frames are texts", "invented", "", "5", "6", "request=53 reply=54"}};

constexpr Declaration<Toy, Encoder> whole{
    .id = "whole",
    .name = "toy",
    .document = "none",
    .link = LinkKind::full_duplex,
    .options = options.infos,
    .format = format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = text_vectors,
    .frames_are_texts = true,
    .frames_size = 1000,
    .report = report,
    .line = [](const Format&) -> LineSettings { return {.rate = 42}; },
    .resolution = [](const Format&) -> Resolution { return {.singleturn_bits = 42}; },
    .is_usable = [](const Format& format) { return format.bits != 3; },
    .guess_request = guess_request,
    .reply_size = [](const Format&, Bytes) -> std::size_t { return 9; },
    .answer_to_bad = [](const Format&, Bytes, Error, Bytes) { return Error::request_rejected; },
    .decode = nullptr,
    .encode = [](const Format&, const Command&, Arguments, MutableBytes) -> Result<std::size_t> { return 11; },
    .frame_end = end_of_frame,
    .is_answered = is_answered,
    .is_checked = is_checked,
    .bits = bits_in,
    .probe = probe,
    .streams = streams,
    .extra_wires = wires,
    .control_bit = control_bit,
    .host_bits = host_bits,
    .reportable = [](const Options&) -> std::uint32_t { return 13; },
    .remembered = remembered,
    .learned = learned,
    .follower = follower,
    .follower_storage = 5,
    .status = &fields.infos[0],
    .alarms = &fields.infos[1],
    .second_status = &fields.infos[1],
    .second_alarms = &fields.infos[0],
    .memory = memory,
    .registers = registers,
    .conditions = conditions,
    .timing = {.pause_bits = 99},
    .over_spi = &unit,
};
constinit const Unit whole_unit = Descriptor<whole>::make();

struct Still final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override { return {}; }
};

Options options_with(std::int64_t bits) {
  Options values;
  values.values[0] = bits;
  return values;
}

constexpr std::array<std::uint8_t, 1> request{5};
constexpr std::array<std::uint8_t, 1> request_without_reply{0x7F};
constexpr std::array<std::uint8_t, 1> bad_request{0x80};
constexpr std::array<std::uint8_t, 1> reply{6};

TEST(Declaration, LeavesOutUndeclaredMembers) {
  EXPECT_EQ(unit.is_checked, nullptr);
  EXPECT_EQ(unit.host_bits, nullptr);
  EXPECT_EQ(unit.bits, nullptr);
  EXPECT_EQ(unit.probe, nullptr);
  EXPECT_EQ(unit.streams, nullptr);
  EXPECT_EQ(unit.extra_wires, nullptr);
  EXPECT_EQ(unit.control_bit, nullptr);
  EXPECT_EQ(unit.remembered, nullptr);
  EXPECT_EQ(unit.learned, nullptr);
  EXPECT_EQ(unit.follower, nullptr);
  EXPECT_EQ(unit.over_spi, nullptr);
  EXPECT_TRUE(unit.memory.empty() && unit.registers.empty() && unit.conditions.empty());
  EXPECT_EQ(unit.models[0].values[0].value, 16);
}

TEST(Declaration, TakesRequestsAndReportableAlarmsFromTheUnit) {
  std::array<std::uint8_t, 4> out{};
  const auto size = whole_unit.encode(options_with(8), whole_unit.commands[0], {}, out);
  ASSERT_TRUE(size.has_value());
  EXPECT_EQ(*size, 11u);
  EXPECT_EQ(whole_unit.reportable(options_with(8)), 13u);
  EXPECT_EQ(unit.reportable, nullptr);
}

TEST(Declaration, ProtocolAndFormatReplaceUndeclaredMembers) {
  NoFields sink;
  const Options narrow = options_with(3);
  EXPECT_EQ(unit.settings(narrow).rate, 3000u);
  EXPECT_EQ(unit.resolution(narrow).singleturn_bits, 3u);
  EXPECT_TRUE(unit.is_answered(narrow, {.bytes = request}));
  EXPECT_FALSE(unit.is_answered(narrow, {.bytes = request_without_reply}));
  EXPECT_EQ(unit.pause(narrow, {.bytes = request}), Time(3ms));
  EXPECT_EQ(unit.frame_end(narrow, Direction::reply, reply).size, 1u);
  EXPECT_EQ(unit.decode(narrow, {.bytes = bad_request}, {.bytes = reply}, sink), Error::bad_framing);
  EXPECT_EQ(unit.explain(narrow, Error::timeout, {}, {}).detail, "explained");
  const Still shaft;
  alignas(std::max_align_t) std::array<std::byte, sizeof(Encoder)> storage{};
  EXPECT_NE(unit.device(narrow, shaft, storage).bytes, nullptr);
}

TEST(Declaration, SetsEachMemberOfTheUnit) {
  EXPECT_EQ(whole_unit.id, "whole");
  EXPECT_EQ(whole_unit.link, LinkKind::full_duplex);
  EXPECT_EQ(whole_unit.host_storage, unit.host_storage + 1000);
  EXPECT_EQ(whole_unit.frame_end(options_with(8), Direction::reply, reply).size, 77u);
  EXPECT_EQ(whole_unit.is_answered, is_answered);
  EXPECT_EQ(whole_unit.is_checked, is_checked);
  EXPECT_EQ(whole_unit.bits, bits_in);
  EXPECT_EQ(whole_unit.host_bits, host_bits);
  EXPECT_EQ(whole_unit.probe, probe);
  EXPECT_EQ(whole_unit.streams, streams);
  EXPECT_EQ(whole_unit.extra_wires, wires);
  EXPECT_EQ(whole_unit.control_bit, control_bit);
  EXPECT_EQ(whole_unit.remembered, remembered);
  EXPECT_EQ(whole_unit.learned, learned);
  EXPECT_EQ(whole_unit.follower, follower);
  EXPECT_EQ(whole_unit.follower_storage, 5u);
  EXPECT_EQ(whole_unit.status, &fields.infos[0]);
  EXPECT_EQ(whole_unit.alarms, &fields.infos[1]);
  EXPECT_EQ(whole_unit.second_status, &fields.infos[1]);
  EXPECT_EQ(whole_unit.second_alarms, &fields.infos[0]);
  EXPECT_EQ(whole_unit.memory.data(), memory.data());
  EXPECT_EQ(whole_unit.registers.data(), registers.data());
  EXPECT_EQ(whole_unit.conditions.data(), conditions.data());
  EXPECT_EQ(whole_unit.timing.pause_bits, 99u);
  EXPECT_EQ(whole_unit.over_spi, &unit);
}

TEST(Declaration, OverridesProtocolAndFormat) {
  NoFields sink;
  EXPECT_EQ(whole_unit.line.rate, 42u);
  EXPECT_EQ(whole_unit.settings(options_with(8)).rate, 42u);
  EXPECT_EQ(whole_unit.resolution(options_with(8)).singleturn_bits, 42u);
  EXPECT_EQ(whole_unit.decode(options_with(8), {.bytes = bad_request}, {.bytes = reply}, sink),
            Error::request_rejected);
  const Still shaft;
  alignas(std::max_align_t) std::array<std::byte, sizeof(Encoder)> storage{};
  EXPECT_EQ(whole_unit.device(options_with(3), shaft, storage).bytes, nullptr);
}

constexpr Declaration<Toy, Encoder> sized = [] {
  Declaration<Toy, Encoder> made = smallest;
  made.reply_size = [](const Format&, Bytes) -> std::size_t { return 9; };
  return made;
}();
constexpr Declaration<Toy, Encoder> decoding{
    .id = "decoding",
    .name = "toy",
    .document = "none",
    .link = LinkKind::half_duplex,
    .options = options.infos,
    .format = format_of<options>,
    .fields = fields.infos,
    .report = report,
    .decode = [](const Format&, Frame, Frame, FieldSink&) { return Error::line_stuck; },
};

constexpr Declaration<Toy, Encoder> controlled = [] {
  Declaration<Toy, Encoder> made = decoding;
  made.decode_control = [](Frame, Frame, FieldSink&) { return Error::sequence_mismatch; };
  return made;
}();

TEST(Declaration, IsKnownByItsMakers) {
  ASSERT_EQ(unit.known_as.size(), 1u);
  EXPECT_EQ(unit.known_as.front(), "maker");
  EXPECT_EQ(unit.lookalikes, "any other toy");
}

TEST(Declaration, SizesReplies) {
  constexpr Unit made = Descriptor<sized>::make();
  const FrameEnd end = made.frame_end(options_with(8), Direction::reply, reply);
  EXPECT_EQ(end.kind, FrameEnd::Kind::incomplete);
  EXPECT_EQ(end.size, 9u);
}

// A Declaration with its own `decode` and without `is_answered` gives a Unit with neither `is_answered` nor `pause`.
TEST(Declaration, DecodesByItself) {
  NoFields sink;
  constexpr Unit made = Descriptor<decoding>::make();
  EXPECT_EQ(made.decode(options_with(8), {.bytes = request}, {.bytes = reply}, sink), Error::line_stuck);
  EXPECT_EQ(made.is_answered, nullptr);
  EXPECT_EQ(made.pause, nullptr);
}

TEST(Declaration, DecodesControlBitsOfFramesWithARequest) {
  NoFields sink;
  constexpr Unit made = Descriptor<controlled>::make();
  EXPECT_EQ(made.decode(options_with(8), {.bytes = request}, {.bytes = reply}, sink), Error::sequence_mismatch);
  EXPECT_EQ(made.decode(options_with(8), {}, {.bytes = reply}, sink), Error::line_stuck);
}

}  // namespace
}  // namespace absenc::author
