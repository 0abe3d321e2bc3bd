// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/recording.hpp"

#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <thread>

#include "absenc/client/test_support.hpp"
#include "absenc/os/error.hpp"

namespace absenc::client {
namespace {

using testing::HasSubstr;

std::vector<std::string> lines_of(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

TEST(ClientRecording, HasALineForEachReading) {
  Encoder encoder = open("sim:tformat?singleturn=32768");
  Recording recording({.path = own_path("record") + ".csv", .encoder = "motor", .rate_hz = 0, .count = 20}, encoder);
  std::uint64_t heard = 0;
  EXPECT_TRUE(recording.run([&](const Sample&) { ++heard; }));
  EXPECT_EQ(recording.counts().readings, 20U);
  EXPECT_EQ(heard, 20U);
  const std::vector<std::string> lines = lines_of(recording.names());
  std::filesystem::remove(recording.names());
  ASSERT_GT(lines.size(), 21U);
  EXPECT_EQ(lines[0], "# absenc record 1");
  EXPECT_EQ(lines[1], "# encoder: motor");
  EXPECT_EQ(std::count_if(lines.begin(), lines.end(), [](const std::string& line) { return line[0] != '#'; }), 21);
  EXPECT_THAT(lines[lines.size() - 2], HasSubstr(",90,32768,"));
  EXPECT_EQ(lines.back(), "# end: 20 rows");
}

TEST(ClientRecording, RefusesToWriteEveryZerothReading) {
  Encoder encoder = open("sim:tformat");
  const RecordingSettings settings{.path = own_path("record") + ".csv", .encoder = "motor", .every = 0};
  EXPECT_THROW(Recording(settings, encoder), UsageError);
  EXPECT_FALSE(std::filesystem::exists(settings.path));
}

TEST(ClientRecording, EndsByCancelWhileItWaits) {
  Encoder encoder = open("sim:tformat");
  Recording recording({.path = own_path("record") + ".jsonl", .encoder = "motor", .rate_hz = 1e-3}, encoder);
  std::thread other;
  // cancels the wait of 1000 s for the next reading
  recording.run([&](const Sample&) { other = std::thread([&] { encoder.cancel(); }); });
  other.join();
  EXPECT_EQ(lines_of(recording.names()).size(), 3U);
  std::filesystem::remove(recording.names());
}

TEST(ClientRecording, SaysWhenItsFileIsGone) {
  Encoder encoder = open("sim:tformat");
  Recording recording({.path = own_path("record") + ".csv", .encoder = "motor", .rate_hz = 0, .count = 20}, encoder);
  std::filesystem::remove(recording.names());
  EXPECT_THAT(thrown_by<os::Failure>([&] { recording.run(); }), HasSubstr(recording.names()));
  EXPECT_EQ(recording.counts().readings, 0U);
}

}  // namespace
}  // namespace absenc::client
