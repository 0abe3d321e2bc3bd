// SPDX-License-Identifier: Apache-2.0
// Checks doctor with encoders that send frames without requests.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>

#include "absenc/client/doctor/path_faults_test.hpp"
#include "absenc/client/doctor/stream_frames.hpp"

namespace absenc::client::path_faults {
namespace {

std::vector<std::pair<const Unit*, std::string>> streaming_units() {
  std::vector<std::pair<const Unit*, std::string>> all;
  for (const Unit* unit : character_units()) {
    if (unit->streams == nullptr) continue;
    std::vector<std::string> modes{""};
    for (const Option& option : unit->options) {
      for (const std::string_view choice : option.choices) modes.push_back(fmt::format("{}={}", option.name, choice));
    }
    for (const std::string& mode : modes) {
      const std::string text = fmt::format("sim:{}{}{}", unit->id, mode.empty() ? "" : "?", mode);
      if (!unit->streams(parse_address(text).options)) continue;
      all.emplace_back(unit, mode);
      break;
    }
  }
  return all;
}

struct StreamFault {
  std::string name;
  Change change;
  std::set<std::string> causes;
  std::function<bool(Time)> is_cut{};
};

std::vector<StreamFault> stream_faults() {
  std::vector<StreamFault> all;
  all.push_back({"none", {}, {"good"}});
  all.push_back({"byte before",
                 [](const ByteList&, ByteList reply) {
                   reply.insert(reply.begin(), 0x00);
                   return reply;
                 },
                 {"byte_before"}});
  all.push_back({"byte after",
                 [](const ByteList&, ByteList reply) {
                   reply.push_back(0xFE);
                   return reply;
                 },
                 {"byte_after"}});
  all.push_back({"end cut off",
                 [](const ByteList&, ByteList reply) {
                   reply.pop_back();
                   return reply;
                 },
                 {"bytes_missing"}});
  all.push_back({"seven bits",
                 [](const ByteList&, ByteList reply) {
                   for (std::uint8_t& byte : reply) byte &= 0x7F;
                   return reply;
                 },
                 {"seven_bits"}});
  all.push_back({"twice",
                 [](const ByteList&, ByteList reply) {
                   reply.insert(reply.end(), reply.begin(), reply.end());
                   return reply;
                 },
                 {"extra_bytes", "two_answer"}});
  all.push_back(
      {"every seventh lost",
       [count = 0](const ByteList&, const ByteList& reply) mutable { return ++count % 7 == 0 ? ByteList{} : reply; },
       {"sometimes_silent"}});
  all.push_back(
      {"loose contact", {}, {"comes_and_goes", "sometimes_silent"}, [](Time now) { return now % 500ms > 350ms; }});
  return all;
}

TEST(DoctorOfStreams, NamesTheFaultOfTheLine) {
  ASSERT_FALSE(streaming_units().empty());
  for (const auto& [unit, mode] : streaming_units()) {
    for (const StreamFault& fault : stream_faults()) {
      SCOPED_TRACE(fmt::format("{} {}: {}", unit->id, mode, fault.name));
      Pair pair = pair_of(*unit, mode, "", {"motion=rpm=20"});
      pair.far.change = fault.change;
      pair.far.is_cut = fault.is_cut;
      const Seen seen = examined(pair.asked, pair.far, {.readings = 1000, .limit = 3s});
      EXPECT_TRUE(fault.causes.contains(seen.first()))
          << seen.examination.verdict() << "\n"
          << (seen.examination.first() != nullptr ? seen.examination.first()->evidence : "");
    }
  }
}

std::vector<Attempted> good_readings(std::size_t count) {
  std::vector<Attempted> readings(count);
  for (std::size_t i = 0; i < count; ++i) {
    readings[i].heard = true;
    readings[i].raw = {static_cast<std::uint8_t>(i), 0x55};
  }
  return readings;
}

std::size_t missing_of(std::vector<Attempted> readings, const std::vector<Time>& arrivals) {
  const std::size_t before = readings.size();
  insert_missing_frames(readings, arrivals);
  return readings.size() - before;
}

std::vector<Time> regular_arrivals(std::size_t count) {
  std::vector<Time> arrivals;
  for (std::size_t i = 0; i < count; ++i) arrivals.push_back(static_cast<std::int64_t>(i) * 10ms);
  return arrivals;
}

TEST(StreamFrames, FramesThatDidNotComeAreFailedReadingsAtTheirTime) {
  std::vector<Attempted> readings = good_readings(30);
  std::vector<Time> arrivals = regular_arrivals(30);
  // moves the arrivals from frame 10 on by three periods, as if three frames before it were missing
  for (std::size_t i = 10; i < 30; ++i) arrivals[i] += 30ms;
  insert_missing_frames(readings, arrivals);
  ASSERT_EQ(readings.size(), 33u);
  for (std::size_t i = 10; i < 13; ++i) {
    EXPECT_EQ(readings[i].error, Error::timeout);
    EXPECT_EQ(readings[i].began, static_cast<std::int64_t>(i) * 10ms);
  }
  EXPECT_EQ(readings[13].raw[0], 10);
}

TEST(StreamFrames, LateFramesAreNotMissing) {
  std::vector<Time> arrivals = regular_arrivals(30);
  // frames 10, 11 and 12 arrive late, together with frame 13
  arrivals[10] = arrivals[11] = arrivals[12] = arrivals[13];
  EXPECT_EQ(missing_of(good_readings(30), arrivals), 0u);
}

TEST(StreamFrames, DamagedFramesAreNotMissing) {
  std::vector<Attempted> readings = good_readings(30);
  std::vector<Time> arrivals = regular_arrivals(30);
  for (std::size_t i = 10; i < 30; ++i) arrivals[i] += 30ms;
  readings[10].discarded = 3;
  EXPECT_EQ(missing_of(readings, arrivals), 0u);
}

TEST(StreamFrames, IrregularFramesAreNotMissing) {
  std::vector<Time> arrivals = regular_arrivals(30);
  for (std::size_t i = 0; i < 30; ++i) arrivals[i] += static_cast<std::int64_t>(i * i) * 1ms;
  EXPECT_EQ(missing_of(good_readings(30), arrivals), 0u);
}

TEST(StreamFrames, FramesThatComeTwiceAreCountedOnlyIfThePositionChanges) {
  std::vector<Attempted> moving;
  std::vector<Time> arrivals;
  for (std::size_t i = 0; i < 30; ++i) {
    for (int copy = 0; copy < 2; ++copy) {
      moving.push_back(good_readings(30)[i]);
      arrivals.push_back(static_cast<std::int64_t>(i) * 10ms + copy * 1ms);
    }
  }
  EXPECT_EQ(count_doubled(moving, arrivals), 29u);
  std::vector<Attempted> still = moving;
  for (Attempted& one : still) one.raw = {1, 2};
  EXPECT_EQ(count_doubled(still, arrivals), 0u);
  EXPECT_EQ(count_doubled(good_readings(60), arrivals), 0u);
}

}  // namespace
}  // namespace absenc::client::path_faults
