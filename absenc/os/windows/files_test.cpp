// SPDX-License-Identifier: Apache-2.0
// Tests files that this program owns, appends to or replaces, with names that are not ASCII.
#include <gtest/gtest.h>

#include <cerrno>
#include <fstream>
#include <sstream>

#include "absenc/os/append.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/line_file.hpp"
#include "absenc/os/owned_file.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/testing.hpp"
#include "absenc/os/windows/files.hpp"

namespace absenc::os {
namespace {

using namespace testing;

class FilesTest : public ::testing::Test {
 protected:
  [[nodiscard]] static std::string content(const std::string& path) {
    std::ifstream file(path_of(path), std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  [[nodiscard]] std::size_t count() const {
    std::size_t files = 0;
    for ([[maybe_unused]] const auto& one : std::filesystem::directory_iterator(folder.path())) ++files;
    return files;
  }
  TemporaryDirectory folder;
  std::string path = name_of(folder.path() / path_of("Meßwerte für Jürgen.txt"));
};

TEST_F(FilesTest, AppendsWholeLines) {
  EXPECT_EQ(append_line(path, "one\n"), 0);
  EXPECT_EQ(append_line(path, "two\n"), 0);
  EXPECT_EQ(content(path), "one\ntwo\n");
}

TEST_F(FilesTest, AppendsBehindALineThatIsNotComplete) {
  std::ofstream(path_of(path), std::ios::binary) << "cut";
  EXPECT_EQ(append_line(path, "two\n"), 0);
  EXPECT_EQ(content(path), "cut\ntwo\n");
}

TEST_F(FilesTest, OwnedFileIsRefusedToASecondOwner) {
  const OwnedFile file(path);
  EXPECT_TRUE(file.made());
  EXPECT_EQ(failure_of([&] { const OwnedFile second(path); }).kind(), Failure::Kind::in_use);
}

TEST_F(FilesTest, OwnedFileIsReplacedAndStaysOwned) {
  OwnedFile file(path);
  file.replace("new\n", Durable::yes);
  EXPECT_EQ(content(path), "new\n");
  EXPECT_EQ(file.beginning(2), "ne");
  EXPECT_EQ(file.state().size, 4);
  EXPECT_TRUE(file.has_its_name());
  EXPECT_EQ(failure_of([&] { const OwnedFile second(path); }).kind(), Failure::Kind::in_use);
  EXPECT_EQ(count(), 1u);
}

TEST_F(FilesTest, LineFileCanBeReadWhileItGrowsAndReplacesNone) {
  LineFile file(path);
  file.append("a,b\n");
  file.append("1,2\n");
  EXPECT_EQ(content(path), "a,b\n1,2\n");
  EXPECT_EQ(file.size(), 8u);
  EXPECT_EQ(failure_of([&] { const LineFile second(path); }).kind(), Failure::Kind::in_use);
}

TEST_F(FilesTest, LineFileInMissingFolderIsNotFound) {
  const std::string missing = (folder.path() / "none" / "a.csv").string();
  EXPECT_EQ(failure_of([&] { const LineFile file(missing); }).kind(), Failure::Kind::not_found);
}

TEST_F(FilesTest, BlockFileAppearsWithItsContent) {
  BlockFile file(path);
  file.write(2, Data{1, 2});
  EXPECT_FALSE(std::filesystem::exists(path_of(path)));
  file.appear();
  file.grow(6);
  Data bytes(8, 9);
  file.read(0, bytes);
  EXPECT_EQ(bytes, (Data{0, 0, 1, 2, 0, 0, 0, 0}));
  EXPECT_EQ(std::filesystem::file_size(path_of(path)), 6u);
}

TEST_F(FilesTest, NewFileReplacesTheOldOneOnlyWhenItIsComplete) {
  replace_file(path, "old", Durable::no);
  {
    NewFile file(path);
    file.write("half");
    EXPECT_EQ(content(path), "old");
    EXPECT_EQ(content(file.path()), "half");
  }
  EXPECT_EQ(content(path), "old");
  replace_file(path, "new", Durable::yes);
  EXPECT_EQ(content(path), "new");
  EXPECT_EQ(count(), 1u);
}

TEST_F(FilesTest, NamelessFileLeavesNothing) {
  {
    const Descriptor file = nameless_file(folder.path().string());
    EXPECT_EQ(write_at(file.get(), 0, "text"), 0);
    EXPECT_EQ(read_at(file.get(), 1, 10, "it"), "ext");
  }
  EXPECT_EQ(count(), 0u);
}

}  // namespace
}  // namespace absenc::os
