// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/sigrok.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <tuple>

#include "absenc/capture/files/test_files.hpp"

namespace absenc::capture {
namespace {

// Returns samples of which a third cannot be compressed.
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

std::string problem(FileBytes bytes, const OpenChoices& choices = {}) {
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
  const CaptureContents contents = read_all(*reader);
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
    const CaptureContents contents = read_all(*reader);
    EXPECT_EQ(contents.blocks, 5u);
    EXPECT_TRUE(contents.samples == samples);
    EXPECT_TRUE(reader->damages().empty());
  }
}

TEST(Sigrok, SamplesOfThreeBytesAreSpread) {
  // Each session has one archive entry with samples. That of the first session is read as one block, that of the second
  // session, which is larger, in parts.
  for (const std::size_t count : {std::size_t{1000}, std::size_t{6'000'000}}) {
    const FileBytes samples = wave(3 * count);
    const auto reader = open_bytes(session(sigrok_metadata("1 MHz", 24, 3), {{"logic-1-1", samples}}));
    const CaptureContents contents = read_all(*reader);
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
    const CaptureContents contents = read_all(*reader);
    EXPECT_TRUE(reader->damages().empty());
    ASSERT_EQ(contents.samples.size(), 4 * size);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < 4; ++j) wrong += contents.samples[4 * i + j] != (j < 3 ? samples[3 * i + j] : 0);
    }
    EXPECT_EQ(wrong, 0u);
  }
}

TEST(Sigrok, UsesRateOfCaller) {
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
  // In each round another byte in the second of three archive entries with samples is changed.
  const std::string_view name = "logic-1-2";
  const auto local = std::search(good.begin(), good.end(), name.begin(), name.end());
  const auto begin = static_cast<std::size_t>(local - good.begin());
  for (std::size_t at = begin + 20; at < begin + 90'000; at += 4001) {
    FileBytes bad = good;
    bad[at] ^= 0x55;
    const auto reader = open_bytes(bad);
    const CaptureContents contents = read_all(*reader);
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

TEST(Sigrok, AMissingPieceIsADamageAndTheOthersKeepTheirTime) {
  const FileBytes samples = wave(300'000);
  for (const auto& [numbers, tick, end, words] :
       std::initializer_list<std::tuple<std::vector<int>, Tick, Tick, std::string>>{
           {{1, 2, 4}, 600'000, 1'200'000, "logic-1-3 is missing"},
           {{1, 5}, 300'000, 1'500'000, "logic-1-2 to logic-1-4 are missing"},
           {{2, 3}, 0, 900'000, "logic-1-1 is missing"}}) {
    std::vector<std::pair<std::string, FileBytes>> pieces;
    for (const int number : numbers) pieces.emplace_back("logic-1-" + std::to_string(number), samples);
    const auto reader = open_bytes(session(sigrok_metadata("1 MHz", 8, 1), pieces));
    const CaptureContents contents = read_all(*reader);
    EXPECT_EQ(contents.end, end) << words;
    EXPECT_EQ(reader->layout().ticks, end) << words;
    EXPECT_EQ(contents.samples.size(), numbers.size() * samples.size());
    ASSERT_EQ(reader->damages().size(), 1u) << words;
    EXPECT_NE(reader->damages()[0].what.find(words), std::string::npos) << reader->damages()[0].what;
    EXPECT_EQ(reader->damages()[0].tick, tick);
    EXPECT_FALSE(reader->damages()[0].note);
  }
}

TEST(Sigrok, APieceWithAWrongChecksumIsLeftOutAndTheOthersCount) {
  const FileBytes samples = wave(1 << 16);
  for (const bool deflate : {true, false}) {
    std::vector<std::pair<std::string, FileBytes>> pieces;
    for (int i = 1; i <= 12; ++i) pieces.emplace_back("logic-1-" + std::to_string(i), samples);
    FileBytes file = session(sigrok_metadata("1 MHz", 8, 1), pieces, "2", deflate);
    // the archive contains the name of an entry twice: in front of the entry's data and in the directory
    constexpr std::string_view name = "logic-1-7";
    const auto in_directory = std::find_end(file.begin(), file.end(), name.begin(), name.end());
    *(in_directory - 30) ^= 1;  // changes a byte of the entry's checksum
    const auto reader = open_bytes(file);
    FileBytes expected;
    for (int i = 0; i < 11; ++i) expected.insert(expected.end(), samples.begin(), samples.end());
    EXPECT_TRUE(read_in_threads(*reader) == expected);
    ASSERT_EQ(reader->damages().size(), 1u);
    EXPECT_EQ(reader->damages()[0].tick, 6u << 16);
    EXPECT_EQ(reader->damages()[0].what, "logic-1-7, which ends at sample 458752, is damaged: its checksum is wrong");
  }
}

TEST(Sigrok, ALargePieceThatIsDamagedEndsWhereItShows) {
  const FileBytes samples = wave(20 << 20);
  const FileBytes behind(1000, 0x5A);
  FileBytes bad = session(sigrok_metadata("1 MHz", 8, 1), {{"logic-1-1", samples}, {"logic-1-2", behind}});
  bad[bad.size() / 2] ^= 0x55;
  const auto reader = open_bytes(bad);
  const CaptureContents contents = read_all(*reader);
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

std::size_t place_of(const FileBytes& file, std::string_view what) {
  return static_cast<std::size_t>(std::search(file.begin(), file.end(), what.begin(), what.end()) - file.begin());
}

bool is_prefix(const FileBytes& prefix, const FileBytes& whole) {
  return prefix.size() <= whole.size() && std::equal(prefix.begin(), prefix.end(), whole.begin());
}

FileBytes cut_at(FileBytes file, std::size_t size) {
  file.resize(size);
  return file;
}

TEST(Sigrok, ReadsEverythingBeforeACut) {
  const FileBytes samples = wave(1500);
  const std::vector<std::pair<std::string, FileBytes>> pieces = {
      {"logic-1-1", {samples.begin(), samples.begin() + 500}},
      {"logic-1-2", {samples.begin() + 500, samples.begin() + 1000}},
      {"logic-1-3", {samples.begin() + 1000, samples.end()}}};
  for (const bool deflate : {true, false}) {
    const FileBytes good = session(sigrok_metadata("1 MHz", 8, 1), pieces, "2", deflate);
    const std::size_t metadata = place_of(good, "metadata");
    // offset of the local header, which begins 30 bytes before the name
    const std::size_t first = place_of(good, "logic-1-1") - 30;
    const std::size_t directory = place_of(good, "PK\x01\x02");
    for (std::size_t size = 4; size < good.size(); ++size) {
      SCOPED_TRACE(size);
      const FileBytes file = cut_at(good, size);
      if (size < first + 39) {  // the file is cut off before the first samples
        const std::string why = problem(file);
        // The deflated data of the entries `version` and `metadata` is complete even without its last byte.
        const std::size_t seen = size + (deflate ? 1 : 0);
        EXPECT_NE(why.find("cut off at byte "), std::string::npos) << why;
        EXPECT_NE(why.find(seen < metadata - 30 ? "version:"
                           : seen < first       ? "metadata:"
                                                : "first sample:"),
                  std::string::npos)
            << why;
        continue;
      }
      const auto reader = open_bytes(file);
      const CaptureContents contents = read_all(*reader);
      EXPECT_TRUE(is_prefix(contents.samples, samples));
      ASSERT_EQ(reader->damages().size(), 1u);
      const Damage& damage = reader->damages()[0];
      EXPECT_EQ(damage.tick, contents.samples.size());
      EXPECT_LE(damage.offset, size);
      // The damage may be reported at the beginning of the header that is incomplete.
      EXPECT_GE(damage.offset + 39, std::min(size, directory));
      EXPECT_EQ(damage.note, size >= directory + 4);
      EXPECT_NE(damage.what.find("cut off"), std::string::npos);
      if (deflate) continue;
      // number of samples before the place where the file is cut off; exactly known only if the samples are not
      // compressed
      std::size_t expected = 0;
      for (const auto& [name, bytes] : pieces) {
        const std::size_t begin = place_of(good, name) + name.size();
        expected += std::min(std::max(size, begin) - begin, bytes.size());
      }
      EXPECT_EQ(contents.samples.size(), expected);
    }
  }
}

TEST(Sigrok, ReadsExpandablePartOfCutPiece) {
  const FileBytes samples = wave(300'000);
  const FileBytes good =
      session(sigrok_metadata("1 MHz", 8, 1), {{"logic-1-1", samples}, {"logic-1-2", samples}, {"logic-1-3", samples}});
  const std::size_t begin = place_of(good, "logic-1-2");
  FileBytes cut = cut_at(good, begin + 60'000);
  const auto reader = open_bytes(cut);
  EXPECT_EQ(reader->layout().ticks, 0u);
  const FileBytes seen = read_in_threads(*reader);
  ASSERT_GT(seen.size(), 400'000u);
  EXPECT_TRUE(std::equal(samples.begin(), samples.end(), seen.begin()));
  EXPECT_TRUE(std::equal(seen.begin() + 300'000, seen.end(), samples.begin()));
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_EQ(reader->damages()[0].offset, cut.size());
  EXPECT_EQ(reader->damages()[0].tick, seen.size());
  EXPECT_NE(reader->damages()[0].what.find("within logic-1-2, and the checksum"), std::string::npos);

  // Deflated data that cannot be expanded further may already be wrong at an earlier place.
  std::mt19937 random(5);
  std::generate(cut.begin() + static_cast<std::ptrdiff_t>(begin) + 1000, cut.end(),
                [&] { return static_cast<std::uint8_t>(random()); });
  const auto damaged = open_bytes(cut);
  EXPECT_EQ(read_all(*damaged).samples, samples);
  ASSERT_EQ(damaged->damages().size(), 2u);
  EXPECT_NE(damaged->damages()[0].what.find("logic-1-2, which ends at sample 600000, is damaged"), std::string::npos);
  EXPECT_EQ(damaged->damages()[1].tick, 300'000u);
}

TEST(Sigrok, ALargePieceMayBeCut) {
  const FileBytes samples = wave(20 << 20);
  for (const bool deflate : {true, false}) {
    FileBytes file = session(sigrok_metadata("1 MHz", 8, 1), {{"logic-1", samples}}, "1", deflate);
    file.resize(file.size() / 2);
    const auto reader = open_bytes(file);
    const CaptureContents contents = read_all(*reader);
    EXPECT_GT(contents.samples.size(), samples.size() / 3);
    EXPECT_TRUE(is_prefix(contents.samples, samples));
    ASSERT_EQ(reader->damages().size(), 1u);
    EXPECT_EQ(reader->damages()[0].tick, contents.end);
    EXPECT_EQ(reader->damages()[0].offset, file.size());
  }
}

TEST(Sigrok, SamplesOfThreeBytesMayBeCut) {
  const FileBytes samples = wave(3000);
  const FileBytes good = session(sigrok_metadata("1 MHz", 24, 3),
                                 {{"logic-1-1", {samples.begin(), samples.begin() + 1000}},
                                  {"logic-1-2", {samples.begin() + 1000, samples.begin() + 2000}},
                                  {"logic-1-3", {samples.begin() + 2000, samples.end()}}},
                                 "2", false);
  const std::size_t second = place_of(good, "logic-1-2") + 9;
  const auto count = [&](std::size_t size) {
    const auto reader = open_bytes(cut_at(good, size));
    const CaptureContents contents = read_all(*reader);
    for (std::size_t i = 0; i < contents.samples.size(); ++i) {
      EXPECT_EQ(contents.samples[i], i % 4 == 3 ? 0 : samples[i / 4 * 3 + i % 4]);
    }
    EXPECT_EQ(reader->damages().size(), 1u);
    return contents.samples.size() / 4;
  };
  // the first archive entry has 333 whole samples and one byte of the next sample; without its two other bytes this
  // sample is lost
  EXPECT_EQ(count(second - 40), 333u);
  EXPECT_EQ(count(second - 1), 333u);
  EXPECT_EQ(count(second + 1), 333u);
  EXPECT_EQ(count(second + 2), 334u);
  EXPECT_EQ(count(second + 4), 334u);
  EXPECT_EQ(count(second + 5), 335u);
}

TEST(Sigrok, ACutArchiveMayHaveSizesOf64Bits) {
  const FileBytes samples = wave(1000);
  FileBytes file =
      session(sigrok_metadata("1 MHz", 8, 1), {{"logic-1-1", samples}, {"logic-1-2", samples}}, "2", false);
  file.resize(place_of(file, "PK\x01\x02"));
  const std::size_t header = place_of(file, "logic-1-1") - 30;
  BinaryWriter extra;
  extra.put(std::uint16_t{0x7777}).put(std::uint16_t{2}).put(std::uint16_t{0});
  extra.put(std::uint16_t{1}).put(std::uint16_t{16}).put(std::uint64_t{1000}).put(std::uint64_t{1000});
  std::fill_n(file.begin() + static_cast<std::ptrdiff_t>(header) + 18, 8, std::uint8_t{0xFF});
  file[header + 28] = static_cast<std::uint8_t>(extra.bytes.size());
  file.insert(file.begin() + static_cast<std::ptrdiff_t>(header) + 39, extra.bytes.begin(), extra.bytes.end());
  for (const std::size_t missing : {std::size_t{0}, std::size_t{300}}) {
    const auto reader = open_bytes(cut_at(file, file.size() - missing));
    const CaptureContents contents = read_all(*reader);
    EXPECT_EQ(contents.blocks, 2u);
    EXPECT_EQ(contents.end, 2000 - missing);
    EXPECT_TRUE(std::equal(samples.begin(), samples.end(), contents.samples.begin()));
    ASSERT_EQ(reader->damages().size(), 1u);
    EXPECT_EQ(reader->damages()[0].offset, file.size() - missing);
  }
}

TEST(Sigrok, ACutArchiveEndsBeforeAnEntryOfUnknownSize) {
  const FileBytes samples = wave(1000);
  FileBytes file = session(sigrok_metadata("1 MHz", 8, 1), {{"logic-1-1", samples}, {"logic-1-2", samples}});
  file.resize(place_of(file, "PK\x01\x02"));
  const std::size_t header = place_of(file, "logic-1-2") - 30;
  file[header + 6] |= 1 << 3;  // flag of a local header: the size is stored behind the data
  const auto reader = open_bytes(file);
  EXPECT_EQ(read_all(*reader).samples, samples);
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_EQ(reader->damages()[0].offset, header);
  EXPECT_FALSE(reader->damages()[0].note);
}

TEST(Sigrok, IsRefusedWithASentence) {
  const std::string metadata = sigrok_metadata("1 MHz", 8, 1);
  EXPECT_NE(problem(session(metadata, {{"logic-1-1", wave(9)}}, "3")).find("has version 3"), std::string::npos);
  EXPECT_NE(problem(session(metadata, {})).find("no logic samples"), std::string::npos);
  EXPECT_NE(problem(make_zip({{"other", wave(9)}})).find("no session of sigrok"), std::string::npos);
  EXPECT_NE(problem(session(sigrok_metadata("1 MHz", 80, 10), {{"logic-1-1", wave(90)}})).find("80 channels"),
            std::string::npos);
  EXPECT_NE(problem(session(metadata, {{"logic-1-1", wave(9)}}), {.channels = 4}).find("8 channels, not 4"),
            std::string::npos);
  EXPECT_NE(problem(to_bytes("PK\x03\x04")).find("cut off at byte 0, before the end of its version"),
            std::string::npos);
}

}  // namespace
}  // namespace absenc::capture
