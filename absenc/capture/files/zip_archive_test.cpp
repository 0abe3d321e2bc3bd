// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/zip_archive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string_view>

#include "absenc/capture/files/test_files.hpp"

namespace absenc::capture {
namespace {

// Returns `size` bytes of which half can be compressed.
FileBytes mixed(std::size_t size) {
  std::mt19937 random(7);
  FileBytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i % 512 < 256 ? random() : i / 512);
  return bytes;
}

const FileBytes content = mixed(100'000);

// Returns byte `at` of the first entry of the archive's directory.
std::uint8_t& in_directory(FileBytes& file, std::size_t at) {
  constexpr std::string_view signature = "PK\x01\x02";
  const auto found = std::search(file.begin(), file.end(), signature.begin(), signature.end());
  return found[static_cast<std::ptrdiff_t>(at)];
}
constexpr std::size_t checksum = 16;
constexpr std::size_t unpacked_size = 24;

struct Expanded {
  bool whole = false;
  FileBytes bytes;
  // true: `open` and `read` returned the right content, and the end of the entry was good
  bool found_by_reading = false;
  std::string problem;
};

Expanded expanded(FileBytes file) {
  const auto source = memory_source(std::move(file));
  ZipArchive archive(*source);
  ZipArchive::Entry entry;
  require_that(archive.find("entry", entry));
  Expanded result;
  result.bytes.resize(static_cast<std::size_t>(entry.size));
  result.whole = archive.expand(entry, result.bytes);
  FileBytes read(result.bytes.size());
  result.found_by_reading =
      archive.open(entry) && archive.read(read) == read.size() && archive.at_good_end() && read == content;
  result.problem = archive.problem();
  return result;
}

TEST(ZipArchive, ExpandsAWholeEntry) {
  const Expanded result = expanded(make_zip({{"entry", content}}));
  EXPECT_TRUE(result.whole);
  EXPECT_TRUE(result.bytes == content);
  EXPECT_TRUE(result.found_by_reading);
}

TEST(ZipArchive, ReadingReportsDamage) {
  for (const bool deflate : {true, false}) {
    const FileBytes good = make_zip({{"entry", content}}, deflate);
    FileBytes file = good;
    in_directory(file, checksum) ^= 1;
    Expanded result = expanded(file);
    EXPECT_FALSE(result.whole);
    EXPECT_EQ(result.problem, "its checksum is wrong");

    file = good;
    file[200] ^= 0x10;  // damages one byte of the entry's data
    result = expanded(file);
    EXPECT_FALSE(result.whole || result.found_by_reading);
    EXPECT_NE(result.problem, "");
  }
  for (const int change : {-1, 1}) {
    FileBytes file = make_zip({{"entry", content}});
    in_directory(file, unpacked_size) = static_cast<std::uint8_t>(in_directory(file, unpacked_size) + change);
    const Expanded result = expanded(file);
    EXPECT_FALSE(result.whole || result.found_by_reading);
  }
}

TEST(ZipArchive, ReadsStoredEntriesWithoutExpand) {
  const Expanded result = expanded(make_zip({{"entry", content}}, false));
  EXPECT_FALSE(result.whole);
  EXPECT_TRUE(result.found_by_reading);
}

TEST(ZipArchive, RefusesUnknownCompression) {
  const Expanded result = expanded(make_zip({{"entry", content}}, zip_int32_t{ZIP_CM_BZIP2}));
  EXPECT_FALSE(result.whole || result.found_by_reading);
  EXPECT_NE(result.problem, "");
}

TEST(ZipArchive, EntriesOfAnySizeOneAfterTheOther) {
  std::vector<std::pair<std::string, FileBytes>> entries;
  for (const std::size_t size : {70'000u, 1u, 0u, 100'000u, 3u})
    entries.emplace_back(std::to_string(size), mixed(size));
  const auto source = memory_source(make_zip(entries));
  ZipArchive archive(*source);
  for (const auto& [name, bytes] : entries) {
    ZipArchive::Entry entry;
    ASSERT_TRUE(archive.find(name, entry));
    FileBytes into(bytes.size(), 0xEE);
    EXPECT_TRUE(archive.expand(entry, into)) << name;
    EXPECT_TRUE(into == bytes) << name;
  }
}

}  // namespace
}  // namespace absenc::capture
