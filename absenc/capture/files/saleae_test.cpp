// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/saleae.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "absenc/capture/files/test_files.hpp"

namespace absenc::capture {
namespace {

using Ticks = std::vector<Tick>;
using Names = std::vector<std::string>;

std::unique_ptr<Reader> open_channels(const std::vector<FileBytes>& files) {
  std::vector<SaleaeChannel> channels;
  for (const FileBytes& file : files) {
    channels.push_back({"Channel " + std::to_string(channels.size()), memory_source(file)});
  }
  return read_saleae(std::move(channels));
}

std::string problem(FileBytes bytes) {
  try {
    static_cast<void>(open_bytes(std::move(bytes)));
  } catch (const OpenError& error) {
    return error.what();
  }
  return "opened";
}

TEST(Saleae, OneChannel) {
  const auto reader = open_bytes(saleae_file(true, -0.001, 0.002, {-0.0005, 0.0, 0.000000002}), {}, "x/digital_3.bin");
  EXPECT_EQ(reader->layout().channels, (Names{"Channel 3"}));
  EXPECT_EQ(reader->layout().ticks_per_second, 1'000'000'000'000u);
  const CaptureContents contents = read_all(*reader);
  EXPECT_TRUE(contents.changes[0].before);
  EXPECT_EQ(contents.changes[0].at, (Ticks{500'000'000, 1'000'000'000, 1'000'002'000}));
  EXPECT_EQ(contents.end, 3'000'000'000u);
  EXPECT_TRUE(reader->damages().empty());
}

TEST(Saleae, ManyChannelsAreMerged) {
  std::mt19937 random(5);
  std::vector<FileBytes> files;
  std::vector<Ticks> expected;
  for (const unsigned pause : {10u, 7u, 5000u, 100'000'000u, 10u}) {
    std::vector<double> times;
    Ticks ticks;
    for (Tick tick = random() % pause + 1; tick < 1'000'000; tick += 1 + random() % pause) {
      times.push_back(static_cast<double>(tick) * 1e-6);
      ticks.push_back(tick * 1'000'000);
    }
    files.push_back(saleae_file(false, 0, 1, times));
    expected.push_back(ticks);
  }
  const auto reader = open_channels(files);
  const CaptureContents contents = read_all(*reader);
  EXPECT_GE(contents.blocks, 30u);
  for (std::size_t i = 0; i < files.size(); ++i) EXPECT_TRUE(contents.changes[i].at == expected[i]) << i;
  EXPECT_EQ(contents.end, 1'000'000'000'000u);
}

TEST(Saleae, ChunksOfVersionOne) {
  BinaryWriter file = saleae_header(1);
  file.put(std::uint64_t{3});
  file.put(std::uint32_t{0}).put(1e6).put(1.0).put(2.0).put(std::uint64_t{2}).put(1.25).put(1.5);
  file.put(std::uint32_t{1}).put(1e6).put(3.0).put(4.0).put(std::uint64_t{1}).put(3.5);
  file.put(std::uint32_t{0}).put(1e6).put(4.0).put(5.0).put(std::uint64_t{0});
  const auto reader = open_bytes(file.bytes);
  const CaptureContents contents = read_all(*reader);
  constexpr Tick second = 1'000'000'000'000;
  EXPECT_EQ(contents.changes[0].at, (Ticks{second / 4, second / 2, 2 * second, 2 * second + second / 2}));
  EXPECT_EQ(contents.end, 4 * second);
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_TRUE(reader->damages()[0].note);
  EXPECT_EQ(reader->damages()[0].tick, second);
  EXPECT_EQ(reader->damages()[0].what.substr(0, 6), "1 gaps");
}

TEST(Saleae, AFileThatIsCutOffEndsAllChannels) {
  std::vector<double> often;
  std::vector<double> rarely;
  for (int i = 1; i < 100'000; ++i) often.push_back(i * 1e-5);
  for (int i = 1; i < 100; ++i) rarely.push_back(i * 1e-2);
  FileBytes cut = saleae_file(false, 0, 1, rarely);
  cut.resize(44 + 8 * 30 + 3);
  const auto reader = open_channels({saleae_file(false, 0, 1, often), cut});
  const CaptureContents contents = read_all(*reader);
  EXPECT_EQ(contents.changes[1].at.size(), 30u);
  EXPECT_EQ(contents.changes[0].at.size(), 30'000u);
  EXPECT_EQ(contents.end, 300'000'000'001u);
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_EQ(reader->damages()[0].offset, 44u + 8 * 30);
  EXPECT_EQ(reader->damages()[0].tick, 300'000'000'000u);
  EXPECT_NE(reader->damages()[0].what.find("Channel 1 ends before the last"), std::string::npos);
}

TEST(Saleae, RefusesInvalidTimes) {
  for (const double time : {0.1, std::numeric_limits<double>::quiet_NaN(), 1e30}) {
    const auto reader = open_bytes(saleae_file(false, 0, 1, {0.25, 0.5, time, 0.75}));
    EXPECT_EQ(read_all(*reader).changes[0].at.size(), 2u);
    ASSERT_EQ(reader->damages().size(), 1u);
    EXPECT_EQ(reader->damages()[0].offset, 44u + 16);
    EXPECT_EQ(reader->damages()[0].tick, 500'000'000'000u);
  }
}

TEST(Saleae, IsRefusedWithASentence) {
  EXPECT_NE(problem(saleae_header(2).bytes).find("has version 2"), std::string::npos);
  EXPECT_NE(problem(saleae_header(0, 1).bytes).find("analog"), std::string::npos);
  EXPECT_NE(problem(saleae_header(0).bytes).find("ends in a header"), std::string::npos);
  EXPECT_NE(problem(saleae_file(false, 2, 1, {})).find("impossible time"), std::string::npos);
  EXPECT_NE(problem(saleae_header(1).put(std::uint64_t{0}).bytes).find("no chunk"), std::string::npos);
}

TEST(Saleae, AFolderIsOneCapture) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("absenc-saleae-" + std::to_string(std::random_device()()));
  std::filesystem::create_directory(folder);
  for (const int channel : {0, 2, 10}) {
    const FileBytes bytes = saleae_file(false, 0, 1, {channel * 0.01 + 0.01});
    std::ofstream(folder / ("digital_" + std::to_string(channel) + ".bin"), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  std::ofstream(folder / "notes.txt") << "nothing";
  const auto reader = open_capture(folder, {});
  EXPECT_EQ(reader->layout().channels, (Names{"Channel 0", "Channel 2", "Channel 10"}));
  const CaptureContents contents = read_all(*reader);
  EXPECT_EQ(contents.changes[2].at, (Ticks{110'000'000'000}));
  EXPECT_THROW(static_cast<void>(open_capture(folder, {.channels = 8})), OpenError);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace absenc::capture
