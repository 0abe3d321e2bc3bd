// SPDX-License-Identifier: Apache-2.0
// Tests of listening to a virtual AksIM-2 that transmits without requests.
#include "absenc/protocol/encolink/listen.hpp"

#include "absenc/core/hex.hpp"
#include "absenc/protocol/encolink/bench_test.hpp"

namespace absenc::encolink {
namespace {

using testing::Bench;
using testing::RawBytes;
using testing::RunResult;
using testing::says;

constexpr std::string_view streaming = "resolution=20 multiturn_bits=16 stream_rate=1000";

TEST(EncolinkListen, FindsFramesByChecksum) {
  Bench bench("resolution=20 multiturn_bits=16 stream_rate=5000");
  bench.shaft.spin(60, bench.line.now());
  bench.pass(1ms + 95us);  // the host starts to listen in the middle of a frame
  Listen listen(testing::multi_format);
  std::vector<std::uint64_t> seen;
  bench.listen(listen, [&] {
    EXPECT_EQ(listen.error(), Error::none) << listen.detail();
    seen.push_back(listen.reading()->singleturn);
    return seen.size() < 49;
  });
  ASSERT_EQ(seen.size(), 49u);
  EXPECT_LT(listen.skipped(), 7u);
  EXPECT_EQ(listen.stream()->discarded, 0u) << "the frame that was under way before";
  for (std::size_t i = 1; i < seen.size(); ++i) EXPECT_GT(seen[i], seen[i - 1]);
  EXPECT_EQ(bench.first_violation(), "");
}

TEST(EncolinkListen, LatchedIsTimeOfPosition) {
  Bench bench(streaming);
  bench.shaft.spin(10'000, bench.line.now());
  Listen listen(testing::multi_format);
  unsigned compared = 0;
  bench.listen(listen, [&] {
    const Reading& reading = *listen.reading();
    EXPECT_EQ(reading.singleturn, bench.encoder.measure(reading.latched).singleturn);
    return ++compared < 9;
  });
  EXPECT_EQ(compared, 9u);
}

// With `stream_rate` set, `position` sends nothing, and other commands but `listen` are refused.
TEST(EncolinkListen, SendsNothingToStreamingEncoder) {
  Bench bench(streaming);
  std::size_t sent = 0;
  bench.line.observe([&](std::size_t sender, Time, Time, std::uint8_t) { sent += sender == 1 ? 1 : 0; });
  for (const Command& command : unit.commands) {
    if (command.verb == Verb::read || command.name == "listen") continue;
    std::vector<std::int64_t> arguments;
    for (const Argument& argument : command.arguments) arguments.push_back(argument.default_value);
    const RunResult refused = bench.run(command.name, arguments);
    EXPECT_EQ(refused.error, Error::unsupported) << command.name;
    EXPECT_TRUE(says(refused.detail, "stream_rate=0")) << command.name << ": " << refused.detail;
  }
  EXPECT_EQ(bench.run("position").reading->singleturn, 0x12345u);
  EXPECT_EQ(sent, 0u);
}

TEST(EncolinkListen, ReportsDamagedFramesAndContinues) {
  Bench bench(streaming);
  bench.tampered.replies([](unsigned frame, RawBytes& reply) {
    if (frame == 10) reply.erase(reply.begin());
    if (frame == 20 || frame == 22) reply[1] ^= 0x40;
    if (frame == 30) reply.insert(reply.begin(), 0x55);
  });
  bench.line.wake(0);
  Listen listen(testing::multi_format);
  std::vector<Error> errors;
  unsigned good = 0;
  bench.listen(listen, [&] {
    if (listen.error() != Error::none) errors.push_back(listen.error());
    if (listen.error() != Error::none) return true;
    // The encoder sent the first position before the test set the shaft.
    EXPECT_TRUE(good == 0 || listen.reading()->singleturn == 0x12345u) << listen.reading()->singleturn;
    return ++good < 40;
  });
  EXPECT_EQ(errors.size(), 3u) << "a loss each; 21 stands alone between 20 and 22";
  EXPECT_EQ(listen.stream()->discarded, 5u) << "10, 20 to 22, 30";
}

TEST(EncolinkListen, NeedsTwoValidFramesInARow) {
  const auto emits = [](Listen& listen, Bytes bytes) {
    listen.next(Time{});
    listen.feed({.kind = Event<std::uint8_t>::Kind::received, .at = 1ms, .items = bytes});
    return listen.next(1ms).kind == Step<std::uint8_t>::Kind::emit;
  };
  const ReplyBytes accident = encode_position(testing::single_format, {.singleturn = 999});
  const ReplyBytes real = encode_position(testing::single_format, {.singleturn = 0x12345});
  Listen listen(testing::single_format);
  EXPECT_FALSE(emits(listen, accident));
  EXPECT_FALSE(emits(listen, hex<"5566">));
  EXPECT_FALSE(emits(listen, real));
  EXPECT_EQ(listen.reading(), nullptr);
  EXPECT_TRUE(emits(listen, real));
  ASSERT_NE(listen.reading(), nullptr);
  EXPECT_EQ(listen.reading()->singleturn, 0x12345u);
  EXPECT_EQ(listen.skipped(), 7u);
}

TEST(EncolinkListen, HasNoReadingAfterStreamEnds) {
  using Kind = Step<std::uint8_t>::Kind;
  const ReplyBytes frame = encode_position(testing::single_format, {.singleturn = 5});
  Listen listen(testing::single_format);
  listen.next(Time{});
  for (int i = 0; i < 3; ++i) {
    listen.feed({.kind = Event<std::uint8_t>::Kind::received, .at = 1ms, .items = frame});
  }
  // The host does not emit the first of the three frames: the frame only shows it where frames begin.
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(listen.next(1ms).kind, Kind::emit);
    EXPECT_NE(listen.reading(), nullptr);
  }
  const Time limit = listen.next(1ms).at;
  EXPECT_EQ(listen.next(limit).kind, Kind::done);
  EXPECT_EQ(listen.error(), Error::timeout);
  EXPECT_EQ(listen.reading(), nullptr);
}

TEST(EncolinkListen, ExplainsWhyNoFrameIsValid) {
  const auto heard = [](std::string_view encoder, const Format& told) {
    Bench bench(encoder);
    Listen listen(told);
    return bench.run(listen);
  };
  const RunResult nothing = heard(testing::multi, testing::multi_format);
  EXPECT_EQ(nothing.error, Error::timeout);
  EXPECT_EQ(nothing.took, listen_limit);
  const RunResult other = heard(streaming, testing::single_format);
  EXPECT_NE(other.error, Error::none);
  EXPECT_TRUE(says(other.detail, "no two frames")) << other.detail;
  EXPECT_EQ(heard(streaming, {.resolution = 18, .multiturn_bits = 16}).error, Error::out_of_range);
  EXPECT_EQ(heard(streaming, {}).error, Error::invalid_argument);
}

}  // namespace
}  // namespace absenc::encolink
