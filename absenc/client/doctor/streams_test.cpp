// SPDX-License-Identifier: Apache-2.0
// Checks faults of encoders that send by themselves, whose frames are separated by pauses and judged like replies.
#include <gtest/gtest.h>

#include "absenc/client/doctor/path_faults_test.hpp"
#include "absenc/client/doctor/stream_frames.hpp"

namespace absenc::client::path_faults {
namespace {

/// Returns the units that send by themselves with their default settings.
std::vector<const Unit*> streaming_units() {
  std::vector<const Unit*> units;
  for (const Unit* unit : character_units()) {
    if (!asked_mode(*unit).empty()) units.push_back(unit);
  }
  return units;
}

std::string sentences(const Examination& examination) {
  std::string text = examination.verdict();
  for (const Finding& one : examination.findings) text += "\n" + one.sentence();
  return text;
}

/// Returns the first finding of each of these units while its shaft turns.
void expect_first(const Ids& causes, const std::function<void(Far&)>& spoil) {
  ASSERT_FALSE(streaming_units().empty());
  for (const Unit* unit : streaming_units()) {
    Pair pair = pair_of(*unit, "", rates_of(*unit).back(), {"motion=rpm=20"});
    spoil(pair.far);
    const Seen seen = examined(pair.asked, pair.far, {.readings = 1000, .limit = 3s});
    EXPECT_TRUE(causes.contains(seen.first())) << unit->id << "\n" << sentences(seen.examination);
  }
}

/// Drops one frame of `count`.
Change leave_out(unsigned count) {
  return [count, number = 0u](const ByteList&, ByteList reply) mutable {
    return ++number % count == 0 ? ByteList{} : reply;
  };
}

TEST(DoctorStreams, HealthyStreamIsGood) {
  expect_first({"good"}, [](Far&) {});
}

TEST(DoctorStreams, ChangedBytesAreNamed) {
  for (const PathFault& fault : faults_of_bytes()) {
    for (const Unit* unit : streaming_units()) {
      SCOPED_TRACE(fmt::format("{}: {}", unit->id, fault.name));
      const std::optional<Outcome> outcome = fault.examine(*unit, "", rates_of(*unit).back());
      if (!outcome) continue;
      EXPECT_TRUE(outcome->causes.contains(outcome->seen.first())) << sentences(outcome->seen.examination);
    }
  }
}

TEST(DoctorStreams, CutFramesMissBytes) {
  expect_first({"bytes_missing"}, [](Far& far) {
    far.change = [](const ByteList&, ByteList reply) {
      reply.pop_back();
      return reply;
    };
  });
}

TEST(DoctorStreams, FramesThatComeTwiceAreNamed) {
  expect_first({"two_answer", "extra_bytes"}, [](Far& far) {
    far.change = [](const ByteList&, const ByteList& reply) {
      ByteList both = reply;
      both.insert(both.end(), reply.begin(), reply.end());
      return both;
    };
  });
}

TEST(DoctorStreams, MissingFramesAreSilence) {
  expect_first({"sometimes_silent"}, [](Far& far) { far.change = leave_out(10); });
}

TEST(DoctorStreams, LooseContactComesAndGoes) {
  expect_first({"comes_and_goes"}, [](Far& far) { far.is_cut = [](Time now) { return now % 500ms < 150ms; }; });
}

// ---- Division by pauses

class StreamFrames : public ::testing::Test {
 protected:
  /// Returns frames of different positions at these times, each of which may be followed at once by more.
  StreamBytes stream_of(const std::vector<Time>& times) {
    StreamBytes stream;
    std::uint8_t number = 0;
    for (const Time at : times) {
      ByteList frame{0xFF, 0x81, 0x05, ++number};
      frame.push_back(static_cast<std::uint8_t>(0xFF + 0x81 + 0x05 + number));
      stream.bytes.insert(stream.bytes.end(), frame.begin(), frame.end());
      stream.marks.push_back({at, stream.bytes.size()});
    }
    return stream;
  }
  std::vector<Attempted> frames_of(const StreamBytes& stream) {
    return stream_frames(*address_.unit, address_.options, stream);
  }
  static std::size_t missing(const std::vector<Attempted>& frames) {
    return static_cast<std::size_t>(
        std::ranges::count_if(frames, [](const Attempted& one) { return one.error == Error::timeout; }));
  }

  EncoderAddress address_ = parse_address("sim:raa38");
};

TEST_F(StreamFrames, FrameThatComesLateIsNotMissing) {
  std::vector<Time> times;
  for (int i = 0; i < 60; ++i) times.push_back(i * 10ms + (i % 20 == 7 ? 9ms : 0ms));
  const std::vector<Attempted> frames = frames_of(stream_of(times));
  EXPECT_EQ(frames.size(), 58u);  // without the first and the last, which may be parts
  EXPECT_EQ(missing(frames), 0u);
}

TEST_F(StreamFrames, FramesThatWereHeldBackAreNotMissing) {
  std::vector<Time> times;
  for (int i = 0; i < 60; ++i) times.push_back(i >= 20 && i < 30 ? 300ms : i * 10ms);
  const std::vector<Attempted> frames = frames_of(stream_of(times));
  EXPECT_EQ(frames.size(), 58u);
  EXPECT_EQ(missing(frames), 0u);
}

TEST_F(StreamFrames, DamagedFramesThatWereHeldBackAreSplit) {
  std::vector<Time> times;
  for (int i = 0; i < 60; ++i) times.push_back(i >= 20 && i < 30 ? 300ms : i * 10ms);
  StreamBytes stream = stream_of(times);
  for (std::uint8_t& byte : stream.bytes) byte &= 0x7F;
  const std::vector<Attempted> frames = frames_of(stream);
  EXPECT_EQ(frames.size(), 58u);
  EXPECT_TRUE(std::ranges::all_of(frames, [](const Attempted& one) { return one.raw.size() == 5; }));
}

TEST_F(StreamFrames, FrameThatDoesNotComeIsMissing) {
  std::vector<Time> times;
  for (int i = 0; i < 60; ++i) {
    if (i % 20 != 7) times.push_back(i * 10ms);
  }
  EXPECT_EQ(missing(frames_of(stream_of(times))), 3u);
}

TEST_F(StreamFrames, UnevenFramesAreNeverMissing) {
  std::vector<Time> times;
  for (int i = 0; i < 60; ++i) times.push_back(i * 10ms + i % 4 * i % 4 * 7ms);
  EXPECT_EQ(missing(frames_of(stream_of(times))), 0u);
}

TEST_F(StreamFrames, NoisyLineHasOtherBytes) {
  StreamBytes stream;
  for (int i = 0; i < 300; ++i) {
    const StreamBytes one = i % 5 == 0 ? stream_of({Time{}}) : StreamBytes{{0x55, 0x12}, {}};
    stream.bytes.insert(stream.bytes.end(), one.bytes.begin(), one.bytes.end());
    stream.marks.push_back({i * 2ms, stream.bytes.size()});
  }
  EXPECT_EQ(bytes_among_others(*address_.unit, address_.options, stream), 300u);
  EXPECT_EQ(bytes_among_others(*address_.unit, address_.options, stream_of(std::vector<Time>(50))), 0u);
}

}  // namespace
}  // namespace absenc::client::path_faults
