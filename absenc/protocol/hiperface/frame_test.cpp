// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/author/unit_bench_test.hpp"
#include "absenc/protocol/hiperface/alarm_follower.hpp"
#include "absenc/protocol/hiperface/fields.hpp"
#include "absenc/protocol/hiperface/unit.hpp"

namespace absenc::hiperface {
namespace {

using Wire = std::vector<std::uint8_t>;

constexpr Request position_request{};

Wire frame_of(const Reply& reply, const Request& request = position_request, const Format& format = {}) {
  const ReplyBytes bytes = encode_reply(format, request, reply);
  return {bytes.view().begin(), bytes.view().end()};
}

// A position with its checksum, as a line of the log of HPMicro's samples prints them.
struct Printed {
  std::uint32_t position;
  std::uint8_t checksum;
};

TEST(HiperfaceFrame, EncodesThePositionsThatHpmicroPrints) {
  // Lines of the log of HPMicro's slave sample, of 2025.
  for (const auto& [position, sum] : std::to_array<Printed>({{0xA5A5, 0x02},
                                                             {0xA5A6, 0x01},
                                                             {0xA5A7, 0x00},
                                                             {0xA5A8, 0x0F},
                                                             {0xA5AF, 0x08},
                                                             {0xA5B0, 0x17},
                                                             {0xA5B8, 0x1F},
                                                             {0xA5BC, 0x1B}})) {
    const Wire frame = frame_of({.value = position});
    EXPECT_EQ(frame.back(), sum) << position;
    EXPECT_EQ(decode_reply({}, position_request, frame)->value, position);
  }
}

TEST(HiperfaceFrame, DecodesThePositionsOfTheEncoderThatHpmicroReads) {
  // Lines of the log of HPMicro's master sample, of 2023. A line prints the turns, the position within the turn shifted
  // to the highest bits of 32, and the checksum with its bits reversed.
  struct Line {
    std::uint16_t turns;
    std::uint32_t position;
    std::uint8_t reversed;
  };
  for (const Line& line : std::to_array<Line>({{0x272, 0x55100000, 0x8A},
                                               {0x272, 0x0A400000, 0x85},
                                               {0x272, 0x0A000000, 0xA5},
                                               {0x271, 0xC0200000, 0xDC},
                                               {0x271, 0x7F900000, 0xD3},
                                               {0x271, 0x6F600000, 0xA3},
                                               {0x271, 0x6FA00000, 0x93},
                                               {0x271, 0x6F900000, 0x53}})) {
    std::uint8_t sum = 0;
    for (unsigned bit = 0; bit < 8; ++bit) sum = static_cast<std::uint8_t>(sum << 1 | (line.reversed >> bit & 1));
    const std::uint32_t whole = std::uint32_t{line.turns} << 12 | line.position >> 20;
    Wire frame{0x40, 0x42};
    for (unsigned i = 4; i-- > 0;) frame.push_back(static_cast<std::uint8_t>(whole >> 8 * i));
    frame.push_back(sum);
    const Result<Reply> reply = decode_reply({}, position_request, frame);
    ASSERT_TRUE(reply) << whole;
    const Reading reading = to_reading({}, position_request, *reply);
    EXPECT_EQ(reading.multiturn, line.turns);
    EXPECT_EQ(reading.singleturn, line.position >> 20);
    EXPECT_EQ(reading.singleturn_validity(), Validity::valid);
  }
}

TEST(HiperfaceFrame, DetectsEveryWrongBitOfReply) {
  const Wire good = frame_of({.value = 0x123456});
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    Wire bad = good;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    // A single wrong bit gives bad_checksum, not a refusal: it cannot change the command 42 to 50, and the checksum is
    // checked first.
    EXPECT_EQ(decode_reply({}, position_request, bad).error(), Error::bad_checksum) << bit;
  }
}

TEST(HiperfaceFrame, PositionWithErrorBitIsNotKnownToHold) {
  const Reading reading = to_reading({}, position_request, {.has_error = true, .value = 0x1234});
  EXPECT_EQ(reading.singleturn_validity(), Validity::unknown);
  EXPECT_EQ(reading.multiturn_validity(), Validity::unknown);
  EXPECT_EQ(reading.alarms_reported, 0u);
  EXPECT_EQ(reading.status, 1u);
}

TEST(HiperfaceFrame, PositionWithoutErrorBitReportsAllAlarmsClear) {
  const Reading reading = to_reading({}, position_request, {.value = 0x1234});
  EXPECT_EQ(reading.alarms_reported, all_alarms);
  EXPECT_EQ(reading.alarms, 0u);
  EXPECT_EQ(reading.status_reported, 1u);
}

TEST(HiperfaceFrame, EachAlarmMakesInvalidWhatItIsAbout) {
  for (const Alarm& alarm : alarms) {
    Reading reading = to_reading({}, position_request, {.value = 0x1234});
    judge(reading, alarm_of(alarm.code), all_alarms);
    const bool warns = (warnings & alarm_of(alarm.code)) != 0;
    const bool turns_only = alarm.code >= 0x21;
    EXPECT_EQ(reading.singleturn_validity(), warns || turns_only ? Validity::valid : Validity::invalid) << alarm.name;
    EXPECT_EQ(reading.multiturn_validity(), warns ? Validity::valid : Validity::invalid) << alarm.name;
  }
}

TEST(HiperfaceFrame, NamesEveryStatusCodeOfTheSources) {
  for (unsigned code = 0; code < 0x24; ++code) {
    const bool known = code <= 0x12 || code >= 0x1C;
    EXPECT_EQ(text_of_status(static_cast<std::uint8_t>(code)) != "a code that no source explains", known) << code;
    const bool is_alarm = (code >= 0x01 && code <= 0x08) || code >= 0x1C;
    EXPECT_EQ(alarm_of(static_cast<std::uint8_t>(code)) != 0, is_alarm) << code;
  }
}

TEST(HiperfaceFrame, TellsLengthOfEachRequestByItsFirstBytes) {
  const Format format;
  const Request store{.command = CommandCode::store_data, .count = 3, .data = [] {
                        FieldBytes bytes;
                        for (const std::uint8_t byte : std::to_array<std::uint8_t>({1, 2, 3})) bytes.push_back(byte);
                        return bytes;
                      }()};
  const RequestBytes bytes = encode_request(store);
  EXPECT_EQ(bytes.size(), 10u);
  EXPECT_EQ(request_length(format, bytes.view().first(1)), 2u);
  EXPECT_EQ(request_length(format, bytes.view().first(2)), 5u);
  EXPECT_EQ(request_length(format, bytes.view().first(5)), 10u);
  EXPECT_EQ(request_length(format, Wire{0x60}), 0u);
  EXPECT_EQ(request_length(format, Wire{0x3F}), 0u);
  EXPECT_EQ(request_length(format, Wire{0x40, 0x45}), 0u);
  EXPECT_EQ(request_length(format, Wire{0x40, 0x4B, 0, 0, 0}), 0u);
  EXPECT_EQ(request_length(format, Wire{0x40, 0x4B, 0, 0, 129}), 0u);
  EXPECT_EQ(request_length(format, Wire{0xFF, 0x4B, 0, 0, 128}), 135u);
  EXPECT_EQ(decode_request(format, bytes)->data.size(), 3u);
}

TEST(HiperfaceFrame, OpenReplyMayRepeatFewerBytesOfRequest) {
  const Request create{.command = CommandCode::create_field, .subject = 5, .code = 0x55, .new_value = 0xC8};
  for (const Wire& data : {Wire{}, Wire{5}, Wire{5, 0xC8}}) {
    Wire frame{0x40, 0x4D};
    frame.insert(frame.end(), data.begin(), data.end());
    frame.push_back(checksum(frame));
    EXPECT_EQ(decode_reply({}, create, frame).error(), Error::none) << data.size();
  }
  Wire longer{0x40, 0x4D, 5, 0xC8, 0x55};
  longer.push_back(checksum(longer));
  EXPECT_EQ(decode_reply({}, create, longer).error(), Error::wrong_length);
  Wire other{0x40, 0x4D, 6};
  other.push_back(checksum(other));
  EXPECT_EQ(decode_reply({}, create, other).error(), Error::unexpected_reply);
}

TEST(HiperfaceFrame, StatusAfterPositionCompletesItInCaptures) {
  AlarmFollower follower{Format{}};
  std::uint64_t number = 0;
  const auto exchange = [&](CommandCode command, std::uint32_t value, std::uint8_t address = first_address) {
    const Request request{.command = command, .address = address};
    const Reply reply{.address = address, .has_error = true, .value = value};
    follower.follow(number++, encode_request(request), encode_reply({}, request, reply));
    Composed one;
    if (!follower.take(one)) return Reading{};
    EXPECT_FALSE(follower.take(one));
    const Result<Request> joined = decode_request({}, one.request);
    const Result<Reply> decoded = decode_reply({}, *joined, one.reply);
    return decoded ? to_reading({}, *joined, *decoded) : Reading{};
  };
  // no position came before this status, so nothing is joined
  EXPECT_EQ(exchange(CommandCode::status, 0x1E).singleturn_bits, 0u);
  EXPECT_EQ(exchange(CommandCode::position, 0x1234).singleturn_bits, 0u);
  const Reading warned = exchange(CommandCode::status, 0x1E);
  EXPECT_EQ(warned.singleturn, 0x234u);
  EXPECT_EQ(warned.alarms, alarm_of(0x1E));
  EXPECT_EQ(warned.alarms_reported, alarm_of(0x1E));
  // the validity is unknown, because another status code may follow
  EXPECT_EQ(warned.singleturn_validity(), Validity::unknown);
  const Reading wrong = exchange(CommandCode::status, 0x21);
  EXPECT_EQ(wrong.alarms, alarm_of(0x1E) | alarm_of(0x21));
  EXPECT_EQ(wrong.singleturn_validity(), Validity::unknown);
  EXPECT_EQ(wrong.multiturn_validity(), Validity::invalid);
  const Reading complete = exchange(CommandCode::status, 0x1E);
  EXPECT_EQ(complete.alarms, wrong.alarms);
  EXPECT_EQ(complete.singleturn_validity(), Validity::valid);
  EXPECT_EQ(complete.multiturn_validity(), Validity::invalid);
  // all alarms were reported before this status, so it is not joined
  EXPECT_EQ(exchange(CommandCode::status, 0x01).singleturn_bits, 0u);
  EXPECT_EQ(exchange(CommandCode::position, 0x1234).singleturn_bits, 0u);
  EXPECT_EQ(exchange(CommandCode::status, 0x00).singleturn_bits, 0u);  // this status code is no alarm
  EXPECT_EQ(exchange(CommandCode::status, 0x1E).singleturn_bits, 0u);
  EXPECT_EQ(exchange(CommandCode::position, 0x1234).singleturn_bits, 0u);
  EXPECT_EQ(exchange(CommandCode::status, 0x1E).singleturn_validity(), Validity::unknown);
  // this status code is in no source
  EXPECT_EQ(exchange(CommandCode::status, 0x77).singleturn_validity(), Validity::unknown);
  EXPECT_EQ(exchange(CommandCode::position, 0x1234).singleturn_bits, 0u);
  EXPECT_EQ(exchange(CommandCode::status, 0x1E, 0x41).singleturn_bits, 0u);  // this is the status of another encoder
  EXPECT_EQ(exchange(CommandCode::status, 0x1E).singleturn_bits, 0u);
}

TEST(HiperfaceFrame, HostWaitsAsDriversDo) {
  const Format format;
  const Time character = format.line().character();
  EXPECT_EQ(Protocol::host_times(format).answer_limit, 50ms + 5 * character);
  EXPECT_EQ(Protocol::host_times(format).pause, 6ms);
  const author::Manner stores = Protocol::manner(format, {.command = CommandCode::set_position});
  EXPECT_EQ(stores.answer_limit, 250ms + 5 * character);
  EXPECT_EQ(stores.repeats, 0u);
  EXPECT_EQ(create_time, 200ms);
  EXPECT_EQ(start_time, 250ms);
  EXPECT_EQ(start_limit, 2s);
}

TEST(HiperfaceFrame, DescriptionOfUnsupportedResolutionShowsNone) {
  const auto described = [](std::uint32_t periods, std::uint32_t turns) {
    std::array<std::uint8_t, description_size> bytes{};
    store_big_endian(MutableBytes(bytes).subspan(2, 4), periods);
    store_big_endian(MutableBytes(bytes).subspan(6, 4), turns);
    const Resolution bits = resolution_in(bytes);
    return std::pair(bits.singleturn_bits, bits.multiturn_bits);
  };
  EXPECT_EQ(described(1024, 4096), std::pair(15u, 12u));
  EXPECT_EQ(described(1024, 0), std::pair(15u, 0u));
  for (const auto& [periods, turns] : {std::pair(1000u, 4096u), {1024u, 4000u}, {1u << 16, 4096u}, {1024u, 1u << 13}}) {
    EXPECT_EQ(described(periods, turns), std::pair(0u, 0u)) << periods << " " << turns;
  }
}

TEST(HiperfaceFrame, RefusesFramesOfNoEncoder) {
  const Format format;
  const auto error_of = [&](Wire bytes) {
    bytes.push_back(checksum(bytes));
    return decode_request(format, bytes).error();
  };
  EXPECT_EQ(error_of({0x3F, 0x42}), Error::unexpected_reply);
  EXPECT_EQ(error_of({0x40, 0x45}), Error::unexpected_reply);
  EXPECT_EQ(error_of({0x40, 0x4A, 0, 0, 129, 0x55}), Error::out_of_range);
  EXPECT_EQ(decode_reply(format, position_request, {}).error(), Error::timeout);
  // From here on the test uses a captured reply without its request.
  const auto alone = [&](Wire bytes) {
    bytes.push_back(checksum(bytes));
    return unit.check(author::testing::options_of(unit, ""), {}, {.bytes = bytes});
  };
  EXPECT_EQ(alone({0x40, 0x42, 0, 0, 0, 1}), Error::none);
  EXPECT_EQ(alone({0x3F, 0x42, 0, 0, 0, 1}), Error::unexpected_reply);
  EXPECT_EQ(alone({0x40, 0x45}), Error::unexpected_reply);
}

TEST(HiperfaceFrame, JoinedStatusRepliesHaveTheirLength) {
  const auto joined = [](std::uint8_t statuses) {
    Wire bytes{0x40, 0x42, 0x02};
    for (unsigned i = 0; i < statuses; ++i) bytes.insert(bytes.end(), {0x40, 0x50, 0x10});
    return bytes;
  };
  const Format format;
  EXPECT_EQ(decode_request(format, joined(17))->statuses, 17u);
  EXPECT_EQ(decode_request(format, joined(18)).error(), Error::wrong_length);
  const Request request{.statuses = 1};
  EXPECT_EQ(decode_reply(format, request, Wire{0x40, 0xC2, 0, 0, 0, 0, 0x82, 0x40, 0xD0, 0x1E, 0x8E})->alarms,
            alarm_of(0x1E));
  EXPECT_EQ(decode_reply(format, request, Wire{0x40, 0xC2, 0, 0, 0, 0, 0x82, 0x40, 0xD0, 0x1E, 0x8E, 0}).error(),
            Error::wrong_length);
}

TEST(HiperfaceFrame, CommandsRefuseWhatTheEncoderDoesNotHave) {
  const Options options = author::testing::options_of(unit, "singleturn_bits=12 multiturn_bits=12");
  std::array<std::uint8_t, request_capacity> bytes{};
  const auto encoded = [&](std::int64_t position) {
    return unit.encode(options, *find_command(unit, "set-position"), std::array{position}, bytes).error();
  };
  EXPECT_EQ(encoded(0xFFFFFF), Error::none);
  EXPECT_EQ(encoded(0x1000000), Error::invalid_argument);
}

TEST(HiperfaceFrame, RefusalAnswersDamagedRequest) {
  const Options options = author::testing::options_of(unit, "");
  const Wire damaged{0x40, 0x42, 0x03};
  const Wire refused{0x40, 0xD0, 0x0A, 0x9A};
  EXPECT_EQ(unit.check(options, {.bytes = damaged}, {}), Error::bad_checksum);
  EXPECT_EQ(unit.check(options, {.bytes = damaged}, {.bytes = refused}), Error::request_rejected);
}

TEST(HiperfaceFrame, FollowerNeedsItsStorage) {
  const Options options = author::testing::options_of(unit, "");
  std::vector<std::byte> storage(unit.follower_storage);
  EXPECT_NE(unit.follower(options, storage), nullptr);
  EXPECT_EQ(unit.follower(options, std::span(storage).first(storage.size() - 1)), nullptr);
}

TEST(HiperfaceFrame, ProbeFindsLengthsOfReplies) {
  struct Collected final : EvidenceSink {
    void put(const OptionEvidence&) override {}
  } sink;
  const auto probed = [&](const std::vector<Wire>& replies) {
    std::vector<Capture> captures;
    for (const Wire& reply : replies) captures.push_back({{}, reply});
    Options options = author::testing::options_of(unit, "");
    const bool agrees = unit.probe(options, captures, sink);
    const auto value = [&](std::string_view name) {
      const auto option = std::ranges::find(unit.options, name, &Option::name);
      return options.values[static_cast<std::size_t>(option - unit.options.begin())];
    };
    return std::tuple(agrees, value("status_bytes"), value("counter_bytes"));
  };
  const Wire position{0x40, 0x42, 0x00, 0x00, 0xA5, 0xA5, 0x02};
  EXPECT_EQ(probed({position}), std::tuple(true, 1, 3));
  EXPECT_EQ(probed({{0x40, 0x50, 0x00, 0x01, 0x11}, position}), std::tuple(true, 2, 3));
  EXPECT_EQ(probed({{0x40, 0x46, 0x01, 0x07}, position}), std::tuple(true, 1, 1));
  EXPECT_EQ(probed({{0x40, 0x46, 0x01, 0x08}, position}), std::tuple(true, 1, 3)) << "a damaged reply shows no length";
  EXPECT_EQ(probed({{0x40, 0x50, 0, 0, 1, 0x11}}), std::tuple(false, 1, 3)) << "no option has this length";
}

TEST(HiperfaceFrame, BroadcastAcceptsAnyAddress) {
  const Request all{.address = broadcast_address};
  EXPECT_TRUE(decode_reply({}, all, frame_of({.address = 0x5F, .value = 1})));
  EXPECT_TRUE(decode_reply({}, all, frame_of({.address = 0xFF, .value = 1})));
  EXPECT_EQ(decode_reply({}, all, frame_of({.address = 0x60, .value = 1})).error(), Error::unexpected_reply);
}

}  // namespace
}  // namespace absenc::hiperface
