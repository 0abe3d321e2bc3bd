// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/owned_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "absenc/os/error.hpp"
#include "absenc/os/linux/testing.hpp"

namespace absenc::os {
namespace {

namespace fs = std::filesystem;

struct OwnedFileTest : ::testing::Test {
  testing::TemporaryDirectory directory;
  std::string path = directory.path() / "kept";

  [[nodiscard]] std::string content() const {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(directory.path()), {}));
  }
  static Failure::Kind refusal(const std::string& name) {
    try {
      const OwnedFile file(name);
    } catch (const Failure& failure) {
      return failure.kind();
    }
    ADD_FAILURE() << "was opened";
    return {};
  }
};

TEST_F(OwnedFileTest, IsMadeAndReplaced) {
  {
    OwnedFile file(path);
    EXPECT_TRUE(file.made());
    for (const char* text : {"one", "another one", ""}) {
      file.replace(text, Durable::no);
      EXPECT_EQ(content(), text);
      EXPECT_EQ(files(), 1u);
    }
    file.replace("last", Durable::yes);
  }
  const OwnedFile again(path);
  EXPECT_FALSE(again.made());
  EXPECT_EQ(content(), "last");
}

TEST_F(OwnedFileTest, HasOneOwner) {
  {
    OwnedFile file(path);
    EXPECT_EQ(refusal(path), Failure::Kind::in_use);
    file.replace("new", Durable::no);
    EXPECT_EQ(refusal(path), Failure::Kind::in_use);
  }
  EXPECT_FALSE(OwnedFile(path).made());
}

TEST_F(OwnedFileTest, IsARegularFile) {
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  for (const std::string& name : {path, std::string("/dev/full"), directory.path().string()}) {
    EXPECT_EQ(refusal(name), Failure::Kind::unsupported) << name;
  }
  EXPECT_EQ(refusal(path + "/below"), Failure::Kind::system);
  fs::create_symlink(directory.path() / "loop", directory.path() / "loop");
  EXPECT_EQ(refusal(directory.path() / "loop"), Failure::Kind::system);
}

TEST_F(OwnedFileTest, LinkToNothingIsRefusedWithItsReason) {
  fs::create_symlink(directory.path() / "gone", path);
  try {
    const OwnedFile file(path);
    FAIL() << "was opened";
  } catch (const Failure& failure) {
    EXPECT_NE(std::string(failure.what()).find("No such file or directory"), std::string::npos) << failure.what();
  }
}

TEST_F(OwnedFileTest, FailedWriteLeavesOldFile) {
  OwnedFile file(path);
  file.replace("old", Durable::no);
  fs::rename(directory.path(), directory.path().string() + "-away");
  EXPECT_THROW(file.replace("new", Durable::no), Failure);
  fs::rename(directory.path().string() + "-away", directory.path());
  EXPECT_EQ(content(), "old");
  EXPECT_EQ(files(), 1u);
}

TEST_F(OwnedFileTest, IncompleteNewFileDisappears) {
  {
    NewFile file(path);
    file.write("half");
  }
  EXPECT_EQ(files(), 0u);
  NewFile file(path);
  file.write("whole");
  file.take_place(Durable::no);
  EXPECT_EQ(content(), "whole");
  EXPECT_EQ(files(), 1u);
}

TEST_F(OwnedFileTest, NamelessFileIsInvisible) {
  const Descriptor file = nameless_file(directory.path());
  EXPECT_EQ(files(), 0u);
  EXPECT_THROW(static_cast<void>(nameless_file(path)), Failure);
}

}  // namespace
}  // namespace absenc::os
