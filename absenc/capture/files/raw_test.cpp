// SPDX-License-Identifier: Apache-2.0
// Tests the reader of raw samples, and some errors of `open_capture`.
#include "absenc/capture/files/raw.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "absenc/capture/files/test_files.hpp"

namespace absenc::capture {
namespace {

FileBytes noise(std::size_t size) {
  std::mt19937 random(7);
  FileBytes bytes(size);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

std::string problem(FileBytes bytes, const OpenChoices& choices) {
  try {
    static_cast<void>(open_bytes(std::move(bytes), choices));
  } catch (const OpenError& error) {
    return error.what();
  }
  return "opened";
}

TEST(Raw, EveryNumberOfChannels) {
  const FileBytes bytes = noise(3 * (1 << 20) + 8 * 11);
  for (unsigned channels = 1; channels <= 64; ++channels) {
    const auto reader = open_bytes(bytes, {.channels = channels, .samples_per_second = 24'000'000});
    EXPECT_EQ(reader->layout().channels.size(), channels);
    EXPECT_EQ(reader->layout().ticks_per_second, 24'000'000u);
    EXPECT_EQ(reader->layout().ticks, bytes.size() / bytes_per_sample(channels));
    const CaptureContents contents = read_all(*reader);
    EXPECT_EQ(contents.samples, bytes);
    EXPECT_EQ(contents.end, reader->layout().ticks);
    EXPECT_EQ(contents.blocks, 4u);
    EXPECT_TRUE(reader->damages().empty());
  }
}

TEST(Raw, BytesThatMakeNoSampleAreADamage) {
  const auto reader = open_bytes(noise(4 * 100 + 3), {.channels = 20, .samples_per_second = 1000});
  EXPECT_EQ(read_all(*reader).samples.size(), 400u);
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_EQ(reader->damages()[0].offset, 400u);
  EXPECT_EQ(reader->damages()[0].tick, 100u);
  EXPECT_NE(reader->damages()[0].what.find("the last 3 bytes"), std::string::npos);
}

TEST(Raw, IsRefusedWithASentence) {
  EXPECT_NE(problem(noise(10), {}).find("number of channels and the sample rate"), std::string::npos);
  EXPECT_NE(problem(noise(10), {.channels = 8}).find("give the sample rate"), std::string::npos);
  EXPECT_NE(problem(noise(10), {.channels = 65, .samples_per_second = 1}).find("1 to 64 channels"), std::string::npos);
  EXPECT_NE(problem({}, {.channels = 8, .samples_per_second = 1}).find("is empty"), std::string::npos);
}

TEST(Raw, ASourceThatFailsCutsItsBlockShort) {
  struct Failing final : Source {
    [[nodiscard]] std::uint64_t size() const override { return 5 << 20; }
    [[nodiscard]] std::size_t read(std::uint64_t offset, std::span<std::uint8_t> into) override {
      const std::size_t good = offset == 0 || offset > (3 << 20) ? into.size() : 1001;
      return std::min(good, into.size());
    }
  };
  const auto reader = read_raw(std::make_unique<Failing>(), "failing", 16, 1000);
  const CaptureContents contents = read_all(*reader);
  ASSERT_EQ(reader->damages().size(), 3u);
  EXPECT_EQ(reader->damages()[0].offset, (1u << 20) + 1001);
  EXPECT_EQ(reader->damages()[0].tick, (1u << 19) + 500);
  EXPECT_EQ(contents.samples.size(), (2u << 20) + 3000);
}

// ---- Tests with files
class Folder : public testing::Test {
 protected:
  Folder() : path_(std::filesystem::temp_directory_path() / ("absenc-raw-" + std::to_string(std::random_device()()))) {
    std::filesystem::create_directory(path_);
  }
  ~Folder() override { std::filesystem::remove_all(path_); }
  [[nodiscard]] std::filesystem::path write(const std::string& name, const FileBytes& bytes) const {
    std::ofstream(path_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return path_ / name;
  }
  std::filesystem::path path_;
};
using RawFile = Folder;

TEST_F(RawFile, IsReadByManyThreadsAtOnce) {
  const FileBytes bytes = noise((17 << 20) + 5);
  const auto reader = open_capture(write("noise.raw", bytes), {.channels = 8, .samples_per_second = 1});
  EXPECT_TRUE(read_in_threads(*reader) == bytes);
}

TEST_F(RawFile, ThatIsMadeShorterWhileItIsReadIsADamage) {
  const auto path = write("shrinks.raw", noise(3 << 20));
  const auto reader = open_capture(path, {.channels = 8, .samples_per_second = 1});
  std::filesystem::resize_file(path, (1 << 20) + 100);
  EXPECT_EQ(read_all(*reader).samples.size(), (1u << 20) + 100);
  ASSERT_EQ(reader->damages().size(), 2u);
  EXPECT_EQ(reader->damages()[0].tick, (1u << 20) + 100);
}

TEST_F(RawFile, MissingFileIsNamed) {
  for (const char* name : {"missing", "."}) {
    try {
      static_cast<void>(open_capture(path_ / name, {.channels = 8, .samples_per_second = 1}));
      ADD_FAILURE() << name;
    } catch (const OpenError& error) {
      EXPECT_NE(std::string(error.what()).find(path_.string()), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace absenc::capture
