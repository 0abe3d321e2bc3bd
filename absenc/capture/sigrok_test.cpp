// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/sigrok.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "absenc/capture/test_files.hpp"

namespace absenc::capture {
namespace {

// Samples like those of a line: long runs, and something that does not compress.
FileBytes wave(std::size_t size) {
  std::mt19937 random(11);
  FileBytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i / 100 % 3 == 0 ? random() : i / 1000);
  return bytes;
}

FileBytes session(const std::string& metadata, std::vector<std::pair<std::string, FileBytes>> pieces,
                  std::string_view version = "2", bool deflate = true) {
  pieces.insert(pieces.begin(), {{"version", to_bytes(version)}, {"metadata", to_bytes(metadata)}});
  return make_zip(pieces, deflate);
}

std::string trouble(FileBytes bytes, const OpenChoices& choices = {}) {
  try {
    static_cast<void>(open_bytes(std::move(bytes), choices));
  } catch (const OpenError& error) {
    return error.what();
  }
  return "opened";
}

TEST(Sigrok, PiecesInARow) {
  const FileBytes samples = wave(2'500'000);
  const auto at = [&](std::size_t first, std::size_t last) {
    return FileBytes(samples.begin() + static_cast<std::ptrdiff_t>(first),
                     samples.begin() + static_cast<std::ptrdiff_t>(last));
  };
  const auto reader =
      open_bytes(session(sigrok_metadata("12.5 MHz", 16, 2), {{"logic-1-1", at(0, 1'000'000)},
                                                              {"logic-1-2", at(1'000'000, 2'000'000)},
                                                              {"logic-1-3", at(2'000'000, 2'500'000)}}));
  EXPECT_EQ(reader->layout().ticks_per_second, 12'500'000u);
  EXPECT_EQ(reader->layout().ticks, 1'250'000u);
  ASSERT_EQ(reader->layout().channels.size(), 16u);
  EXPECT_EQ(reader->layout().channels[15], "D15");
  const Contents contents = read_all(*reader);
  EXPECT_EQ(contents.samples, samples);
  EXPECT_EQ(contents.blocks, 3u);
  EXPECT_TRUE(reader->damages().empty());
}

TEST(Sigrok, ManyThreadsExpandPiecesAtOnce) {
  std::vector<std::pair<std::string, FileBytes>> pieces;
  FileBytes expected;
  for (int i = 1; i <= 40; ++i) {
    pieces.emplace_back("logic-1-" + std::to_string(i), wave(static_cast<std::size_t>(50'000 + 1000 * i)));
    expected.insert(expected.end(), pieces.back().second.begin(), pieces.back().second.end());
  }
  const auto reader = open_bytes(session(sigrok_metadata("1 MHz", 8, 1), pieces));
  EXPECT_TRUE(read_in_threads(*reader) == expected);
  EXPECT_TRUE(reader->damages().empty());
}

TEST(Sigrok, OnePieceThatIsLargeComesInParts) {
  const FileBytes samples = wave((17 << 20) + 6);
  for (const bool deflate : {true, false}) {
    const auto reader = open_bytes(session(sigrok_metadata("1 kHz", 8, 1), {{"logic-1", samples}}, "1", deflate));
    const Contents contents = read_all(*reader);
    EXPECT_EQ(contents.blocks, 5u);
    EXPECT_TRUE(contents.samples == samples);
    EXPECT_TRUE(reader->damages().empty());
  }
}

TEST(Sigrok, SamplesOfThreeBytesAreSpread) {
  for (const std::size_t count : {std::size_t{1000}, std::size_t{6'000'000}}) {  // as a piece, and in parts
    const FileBytes samples = wave(3 * count);
    const auto reader = open_bytes(session(sigrok_metadata("1 MHz", 24, 3), {{"logic-1-1", samples}}));
    const Contents contents = read_all(*reader);
    ASSERT_EQ(contents.samples.size(), 4 * count);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < 4; ++j) wrong += contents.samples[4 * i + j] != (j < 3 ? samples[3 * i + j] : 0);
    }
    EXPECT_EQ(wrong, 0u);
  }
}

TEST(Sigrok, SamplesThatPiecesCutInTwo) {
  for (const std::size_t size : {std::size_t{1000}, std::size_t{(16 << 20) + 1}}) {
    const FileBytes samples = wave(3 * size);
    std::vector<std::pair<std::string, FileBytes>> pieces;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto from = samples.begin() + static_cast<std::ptrdiff_t>(i * size);
      pieces.emplace_back("logic-1-" + std::to_string(i + 1),
                          FileBytes(from, from + static_cast<std::ptrdiff_t>(size)));
    }
    const auto reader = open_bytes(session(sigrok_metadata("1 MHz", 24, 3), pieces, "2", false));
    const Contents contents = read_all(*reader);
    EXPECT_TRUE(reader->damages().empty());
    ASSERT_EQ(contents.samples.size(), 4 * size);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < 4; ++j) wrong += contents.samples[4 * i + j] != (j < 3 ? samples[3 * i + j] : 0);
    }
    EXPECT_EQ(wrong, 0u);
  }
}

TEST(Sigrok, TheRateMayComeFromOutside) {
  const FileBytes file = session(sigrok_metadata("", 8, 1), {{"logic-1-1", wave(100)}});
  EXPECT_EQ(open_bytes(file)->layout().ticks_per_second, 0u);
  EXPECT_EQ(open_bytes(file, {.samples_per_second = 5000})->layout().ticks_per_second, 5000u);
}

TEST(Sigrok, AnalogChannelsAreNoted) {
  std::string metadata = sigrok_metadata("1 MHz", 8, 1);
  metadata.replace(metadata.find("analog=0"), 8, "analog=2");
  const auto reader = open_bytes(session(metadata, {{"logic-1-1", wave(100)}, {"analog-1-9-1", wave(400)}}));
  EXPECT_EQ(read_all(*reader).samples, wave(100));
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_TRUE(reader->damages()[0].note);
  EXPECT_NE(reader->damages()[0].what.find("2 analog channels"), std::string::npos);
}

TEST(Sigrok, ADamagedPieceIsCutShortAndTheOthersCount) {
  const FileBytes samples = wave(300'000);
  const FileBytes good =
      session(sigrok_metadata("1 MHz", 8, 1), {{"logic-1-1", samples}, {"logic-1-2", samples}, {"logic-1-3", samples}});
  // The second of the three, by its name in the local header; behind it, what was deflated.
  const std::string_view name = "logic-1-2";
  const auto local = std::search(good.begin(), good.end(), name.begin(), name.end());
  const auto begin = static_cast<std::size_t>(local - good.begin());
  for (std::size_t at = begin + 20; at < begin + 90'000; at += 4001) {
    FileBytes bad = good;
    bad[at] ^= 0x55;
    const auto reader = open_bytes(bad);
    const Contents contents = read_all(*reader);
    EXPECT_EQ(contents.end, 900'000u);
    ASSERT_EQ(reader->damages().size(), 1u) << at;
    const Damage& damage = reader->damages()[0];
    EXPECT_LE(damage.offset, begin);
    EXPECT_GT(damage.offset + 100, begin);
    EXPECT_NE(damage.what.find("logic-1-2"), std::string::npos);
    EXPECT_EQ(damage.tick, 300'000u);
    ASSERT_EQ(contents.samples.size(), 600'000u);
    EXPECT_TRUE(std::equal(samples.begin(), samples.end(), contents.samples.begin()));
    EXPECT_TRUE(std::equal(samples.begin(), samples.end(), contents.samples.begin() + 300'000));
  }
}

TEST(Sigrok, ALargePieceThatIsDamagedEndsWhereItShows) {
  const FileBytes samples = wave(20 << 20);
  const FileBytes behind(1000, 0x5A);
  FileBytes bad = session(sigrok_metadata("1 MHz", 8, 1), {{"logic-1-1", samples}, {"logic-1-2", behind}});
  bad[bad.size() / 2] ^= 0x55;
  const auto reader = open_bytes(bad);
  const Contents contents = read_all(*reader);
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_EQ(contents.end, (20u << 20) + 1000);
  ASSERT_GT(contents.samples.size(), (5u << 20));
  EXPECT_TRUE(std::equal(samples.begin(), samples.begin() + (5 << 20), contents.samples.begin()));
  EXPECT_TRUE(std::equal(behind.begin(), behind.end(), contents.samples.end() - 1000));
}

TEST(Sigrok, APieceThatIsNoWholeSamplesIsADamage) {
  const auto reader = open_bytes(session(sigrok_metadata("1 MHz", 16, 2), {{"logic-1-1", wave(1001)}}));
  EXPECT_EQ(read_all(*reader).samples.size(), 1000u);
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_EQ(reader->damages()[0].tick, 500u);
}

TEST(Sigrok, IsRefusedWithASentence) {
  const std::string metadata = sigrok_metadata("1 MHz", 8, 1);
  EXPECT_NE(trouble(session(metadata, {{"logic-1-1", wave(9)}}, "3")).find("has version 3"), std::string::npos);
  EXPECT_NE(trouble(session(metadata, {})).find("no logic samples"), std::string::npos);
  EXPECT_NE(trouble(make_zip({{"other", wave(9)}})).find("no session of sigrok"), std::string::npos);
  EXPECT_NE(trouble(session(sigrok_metadata("1 MHz", 80, 10), {{"logic-1-1", wave(90)}})).find("80 channels"),
            std::string::npos);
  EXPECT_NE(trouble(session(metadata, {{"logic-1-1", wave(9)}}), {.channels = 4}).find("8 channels, not 4"),
            std::string::npos);
  FileBytes cut = session(metadata, {{"logic-1-1", wave(9999)}});
  cut.resize(cut.size() / 2);
  EXPECT_NE(trouble(cut).find("perhaps cut off"), std::string::npos);
}

}  // namespace
}  // namespace absenc::capture
