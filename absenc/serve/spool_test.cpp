// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/spool.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "absenc/client/error.hpp"
#include "absenc/serve/fields.hpp"

namespace absenc::serve {

namespace {

namespace fs = std::filesystem;

constexpr std::int64_t million = 1'000'000;

struct SpoolTest : testing::Test {
  SpoolTest() {
    std::string name = fs::temp_directory_path() / "absenc-spool-XXXXXX";
    folder = ::mkdtemp(name.data());
    path = folder / "spool";
  }
  ~SpoolTest() override { fs::remove_all(folder); }

  static std::vector<Message> messages(std::int64_t first, std::int64_t count, std::size_t size = 10) {
    std::vector<Message> made;
    for (std::int64_t id = first; id < first + count; ++id) {
      made.push_back({id, "topic", std::to_string(id) + std::string(size, 'x'), 2});
    }
    return made;
  }

  static std::vector<std::int64_t> ids(const std::vector<Message>& of) {
    std::vector<std::int64_t> all;
    for (const Message& one : of) all.push_back(one.id);
    return all;
  }

  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(path), fs::directory_iterator()));
  }

  fs::path folder, path;
};

}  // namespace

TEST_F(SpoolTest, KeepsUnacknowledgedMessagesAcrossRestart) {
  std::string source;
  {
    Spool spool(path, million);
    source = spool.source();
    spool.add(messages(1, 5), {{"elbow", 11}});
    EXPECT_EQ(ids(spool.after(1, 3)), (std::vector<std::int64_t>{2, 3, 4}));
    spool.remove({3});
  }
  Spool spool(path, million);
  EXPECT_EQ(spool.source(), source);
  EXPECT_EQ(ids(spool.after(0, 100)), (std::vector<std::int64_t>{1, 2, 4, 5}));
  EXPECT_EQ(spool.stored().messages, 4U);
  EXPECT_EQ(spool.stored().readings, 8U);
  EXPECT_EQ(spool.next_id(), 6);
  EXPECT_EQ(spool.next_numbers().at("elbow"), 11U);
}

TEST_F(SpoolTest, KeepsReadingNumbersWhenTheirFilesAreDeleted) {
  {
    Spool spool(path, million);
    spool.add(messages(1, 1), {{"elbow", 11}, {"wrist", 7}});
    spool.forget("wrist");
    for (std::int64_t id = 2; id < 400; ++id) spool.add(messages(id, 1, 1000), {});
    EXPECT_GT(files(), 5U);
    std::vector<std::int64_t> all = ids(spool.after(0, 1000));
    ASSERT_EQ(all.size(), 399U);
    spool.remove(all);
    EXPECT_EQ(files(), 1U);
    EXPECT_EQ(spool.stored_bytes(), 0);
  }
  Spool spool(path, million);
  EXPECT_EQ(spool.next_numbers(), (std::map<std::string, std::uint64_t>{{"elbow", 11}}));
  EXPECT_EQ(spool.next_id(), 400);
}

TEST_F(SpoolTest, DropsAndCountsOldestMessagesBeyondSizeLimit) {
  Spool spool(path, million);
  for (std::int64_t id = 1; id <= 2000; ++id) spool.add(messages(id, 1, 1000), {});
  const Spool::Dropped dropped = spool.take_dropped();
  EXPECT_EQ(dropped.counts.messages + spool.stored().messages, 2000U);
  EXPECT_EQ(dropped.counts.readings + spool.stored().readings, 4000U);
  EXPECT_LE(spool.stored_bytes(), million);
  EXPECT_EQ(spool.after(0, 1).front().id, static_cast<std::int64_t>(dropped.counts.messages) + 1);
  EXPECT_EQ(spool.take_dropped().counts.messages, 0U);
}

TEST_F(SpoolTest, ReturnsMessagesAfterAnyIdInAnyOrder) {
  Spool spool(path, million);
  for (std::int64_t id = 1; id <= 300; ++id) spool.add(messages(id, 1, 500), {});
  for (const std::int64_t id : {200, 0, 299, 150, 151, 10, 300}) {
    const std::vector<std::int64_t> found = ids(spool.after(id, 7));
    ASSERT_EQ(found.size(), static_cast<std::size_t>(std::min<std::int64_t>(7, 300 - id)));
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], id + 1 + static_cast<std::int64_t>(i));
  }
}

TEST_F(SpoolTest, ReadsMessagesBeforeDamage) {
  {
    Spool spool(path, million);
    spool.add(messages(1, 20), {{"elbow", 11}});
  }
  const fs::path file = fs::directory_iterator(path)->path();
  std::ifstream whole(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(whole), {}};
  for (std::size_t at = 0; at < bytes.size(); at += 7) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    for (const std::string& content : {damaged, bytes.substr(0, at)}) {
      fs::remove_all(path);
      fs::create_directory(path);
      std::ofstream(file, std::ios::binary) << content;
      Spool spool(path, million);
      const std::vector<std::int64_t> found = ids(spool.after(0, 100));
      ASSERT_LE(found.size(), 20U);
      for (std::size_t i = 0; i < found.size(); ++i) ASSERT_EQ(found[i], static_cast<std::int64_t>(i) + 1) << at;
      spool.remove(found);
      spool.add(messages(spool.next_id(), 1), {});
      ASSERT_EQ(spool.stored().messages, 1U) << at;
    }
  }
}

// The format is the number in the first record of a file: checksum, size, kind and mark are 10 bytes before it.
TEST_F(SpoolTest, RefusesFormatOfNewerVersionAndReadsFilesWithoutFormat) {
  {
    Spool spool(path, million);
    spool.add(messages(1, 3), {{"elbow", 11}});
  }
  const fs::path file = fs::directory_iterator(path)->path();
  std::ifstream whole(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(whole), {}};
  const auto write = [&](const std::string& content) { std::ofstream(file, std::ios::binary) << content; };

  // FNV-1a over the kind 'v' and the number 2
  write(FieldWriter().add(0xBAA6427BU).add(4U).bytes() + "vw" + FieldWriter().add(2U).bytes() + bytes.substr(14));
  try {
    const Spool spool(path, million);
    FAIL() << "a newer spool was opened";
  } catch (const client::Failure& failure) {
    EXPECT_THAT(failure.what(), testing::HasSubstr("has format 2, that of a newer absenc"));
  }
  EXPECT_EQ(files(), 1U);

  write(bytes.substr(14));
  Spool spool(path, million);
  EXPECT_EQ(ids(spool.after(0, 100)), (std::vector<std::int64_t>{1, 2, 3}));
  EXPECT_EQ(spool.next_numbers().at("elbow"), 11U);
}

TEST_F(SpoolTest, RefusesSecondProcess) {
  const Spool spool(path, million);
  EXPECT_THROW(Spool(path, million), client::Failure);
  EXPECT_THROW(Spool(path / "none" / "spool", million), client::Failure);
}

}  // namespace absenc::serve
