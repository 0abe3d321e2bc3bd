// SPDX-License-Identifier: Apache-2.0
// Tests that files of sigrok-cli are read as the levels or bytes of its samples.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "absenc/capture/annotate/drawing.hpp"
#include "absenc/capture/files/test_files.hpp"

namespace absenc::capture {
namespace {

class SigrokCli : public testing::Test {
 protected:
  SigrokCli()
      : folder_(std::filesystem::temp_directory_path() / ("absenc-sigrok-" + std::to_string(std::random_device()()))) {
    std::filesystem::create_directory(folder_);
  }
  ~SigrokCli() override { std::filesystem::remove_all(folder_); }

  // Returns random samples of `channels` lines, and writes them to the file `samples`.
  FileBytes make_samples(unsigned channels, std::size_t count) {
    std::mt19937_64 random(channels);
    const unsigned bytes = (channels + 7) / 8;
    FileBytes samples;
    std::uint64_t levels = 1;
    for (std::size_t i = 0; i < count; ++i) {
      if (random() % 16 == 0) levels ^= std::uint64_t{1} << random() % channels;
      for (unsigned j = 0; j < bytes; ++j) samples.push_back(static_cast<std::uint8_t>(levels >> 8 * j));
    }
    std::ofstream(folder_ / "samples", std::ios::binary)
        .write(reinterpret_cast<const char*>(samples.data()), static_cast<std::streamsize>(samples.size()));
    return samples;
  }

  void run(const std::string& arguments) {
    const std::string command = "cd '" + folder_.string() + "' && timeout 60 sigrok-cli " + arguments + " >log 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }

  // Writes raw samples as a session, which sigrok-cli then converts to the other formats.
  void write_session(unsigned channels) {
    run("-I binary:numchannels=" + std::to_string(channels) + ":samplerate=12500000 -i samples -o session");
  }

  std::filesystem::path folder_;
};

// Returns the level changes of one channel in samples of `bytes` bytes each.
Changes changes_of(const FileBytes& samples, unsigned bytes, unsigned channel) {
  Changes changes;
  bool level = false;
  for (std::size_t i = 0; i < samples.size() / bytes; ++i) {
    const bool now = (samples[i * bytes + channel / 8] >> channel % 8 & 1) != 0;
    if (i == 0) {
      changes.before = now;
    } else if (now != level) {
      changes.at.push_back(i);
    }
    level = now;
  }
  return changes;
}

TEST_F(SigrokCli, Sessions) {
  for (const unsigned channels : {1u, 8u, 16u, 24u}) {
    const FileBytes samples = make_samples(channels, 2'500'000);
    ASSERT_NO_FATAL_FAILURE(write_session(channels));
    const auto reader = open_capture(folder_ / "session", {});
    EXPECT_EQ(reader->layout().ticks_per_second, 12'500'000u);
    EXPECT_EQ(reader->layout().channels.size(), channels);
    const CaptureContents contents = read_all(*reader);
    EXPECT_EQ(contents.end, 2'500'000u);
    EXPECT_TRUE(reader->damages().empty());
    const unsigned bytes = (channels + 7) / 8;
    const unsigned read = static_cast<unsigned>(contents.samples.size() / 2'500'000);
    for (unsigned channel = 0; channel < channels; ++channel) {
      EXPECT_TRUE(changes_of(contents.samples, read, channel).at == changes_of(samples, bytes, channel).at) << channel;
    }
  }
}

TEST_F(SigrokCli, CutSessions) {
  make_samples(8, 9'000'000);
  ASSERT_NO_FATAL_FAILURE(write_session(8));
  Drawing drawing("wire");
  drawing.add_wire("D0", false);
  drawing.set_end(9'000'000);
  std::mt19937 random(8);
  for (Tick at = 1; at < drawing.end(); at += 1 + random() % 99) drawing.change(at, 0);
  write_sigrok((folder_ / "drawn").string(), drawing, 1'000'000'000);
  for (const char* name : {"session", "drawn"}) {
    const CaptureContents whole = read_all(*open_capture(folder_ / name, {}));
    ASSERT_EQ(whole.end, 9'000'000u);
    ASSERT_EQ(whole.blocks, 3u);  // nine million samples are three blocks of up to 4 MiB
    const std::uintmax_t size = std::filesystem::file_size(folder_ / name);
    for (const std::uintmax_t percent : {90u, 60u, 20u}) {
      std::filesystem::resize_file(folder_ / name, size * percent / 100);
      const auto reader = open_capture(folder_ / name, {});
      const CaptureContents contents = read_all(*reader);
      EXPECT_NEAR(static_cast<double>(contents.end), 90'000.0 * static_cast<double>(percent), 200'000) << name;
      EXPECT_TRUE(std::equal(contents.samples.begin(), contents.samples.end(), whole.samples.begin()));
      ASSERT_EQ(reader->damages().size(), 1u);
      EXPECT_EQ(reader->damages()[0].offset, size * percent / 100);
      EXPECT_EQ(reader->damages()[0].tick, contents.end);
    }
  }
}

TEST_F(SigrokCli, ValueChangeDumps) {
  const FileBytes samples = make_samples(10, 300'000);
  ASSERT_NO_FATAL_FAILURE(write_session(10));
  ASSERT_NO_FATAL_FAILURE(run("-i session -O vcd -o dump"));
  const auto reader = open_capture(folder_ / "dump", {});
  ASSERT_EQ(reader->layout().channels.size(), 10u);
  const Tick tick = reader->layout().ticks_per_second / 12'500'000;
  ASSERT_EQ(tick * 12'500'000, reader->layout().ticks_per_second);
  const CaptureContents contents = read_all(*reader);
  EXPECT_TRUE(reader->damages().empty());
  for (unsigned channel = 0; channel < 10; ++channel) {
    Changes expected = changes_of(samples, 2, channel);
    for (Tick& at : expected.at) at *= tick;
    EXPECT_EQ(contents.changes[channel].before, expected.before);
    EXPECT_TRUE(contents.changes[channel].at == expected.at) << channel;
  }
}

TEST_F(SigrokCli, CommaSeparatedValues) {
  const FileBytes samples = make_samples(5, 200'000);
  ASSERT_NO_FATAL_FAILURE(write_session(5));
  ASSERT_NO_FATAL_FAILURE(run("-i session -O csv -o rows"));
  ASSERT_NO_FATAL_FAILURE(run("-i session -O csv:time=true:dedup=true -o times"));
  const auto rows = open_capture(folder_ / "rows", {});
  EXPECT_EQ(rows->layout().ticks_per_second, 12'500'000u);
  const CaptureContents by_row = read_all(*rows);
  const auto times = open_capture(folder_ / "times", {});
  EXPECT_EQ(times->layout().ticks_per_second % 1'000, 0u);
  const CaptureContents by_time = read_all(*times);
  EXPECT_TRUE(rows->damages().empty());
  EXPECT_TRUE(times->damages().empty());
  for (unsigned channel = 0; channel < 5; ++channel) {
    const Changes expected = changes_of(samples, 1, channel);
    EXPECT_TRUE(by_row.changes[channel].at == expected.at) << channel;
    EXPECT_EQ(by_time.changes[channel].at.size(), expected.at.size()) << channel;
  }
}

TEST_F(SigrokCli, TheBytesOfItsDecoder) {
  FileBytes samples;
  const auto level = [&](bool high) { samples.insert(samples.end(), 10, high ? 1 : 0); };
  for (int i = 0; i < 20; ++i) level(true);
  const FileBytes sent = {0x1A, 0x35, 0x00, 0xFF};
  for (const std::uint8_t byte : sent) {
    level(false);
    for (unsigned bit = 0; bit < 8; ++bit) level((byte >> bit & 1) != 0);
    level(true);
  }
  std::ofstream(folder_ / "samples", std::ios::binary)
      .write(reinterpret_cast<const char*>(samples.data()), static_cast<std::streamsize>(samples.size()));
  const std::string decode = "-I binary:numchannels=1:samplerate=96000 -i samples -P uart:rx=0:baudrate=9600";
  for (const char* more : {"", " -A uart=rx-data", " --protocol-decoder-samplenum"}) {
    ASSERT_NO_FATAL_FAILURE(run(decode + more));
    const auto reader = open_capture(folder_ / "log", {.samples_per_second = 96'000});
    const CaptureContents contents = read_all(*reader);
    EXPECT_TRUE(reader->damages().empty()) << more << reader->damages()[0].what;
    FileBytes seen;
    for (const Character& one : contents.bytes) seen.push_back(one.value);
    EXPECT_EQ(seen, sent) << more;
    if (reader->layout().ticks_per_second != 0) {
      ASSERT_FALSE(contents.bytes.empty());
      EXPECT_EQ(contents.bytes[0].begin, 210u);
      EXPECT_EQ(contents.bytes[0].end, 290u);
    }
  }
}

}  // namespace
}  // namespace absenc::capture
