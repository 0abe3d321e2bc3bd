// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/line_file.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "absenc/os/error.hpp"

namespace absenc::os {
namespace {

namespace fs = std::filesystem;

/// A temporary directory, removed at the end.
struct Directory {
  Directory() {
    std::string name = fs::temp_directory_path() / "absenc-line-file-XXXXXX";
    path = ::mkdtemp(name.data());
  }
  ~Directory() { fs::remove_all(path); }
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;
  fs::path path;
};

std::string content(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

TEST(LineFile, GrowsAtOnce) {
  const Directory directory;
  LineFile file(directory.path / "log");
  file.append("one\n");
  EXPECT_EQ(content(file.path()), "one\n");
  file.append("two\nthree\n");
  EXPECT_EQ(content(file.path()), "one\ntwo\nthree\n");
  EXPECT_EQ(file.size(), 14u);
  file.sync();
}

TEST(LineFile, RefusesExistingFile) {
  const Directory directory;
  std::ofstream(directory.path / "log") << "precious";
  try {
    LineFile file(directory.path / "log");
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.kind(), Failure::Kind::in_use);
  }
  EXPECT_EQ(content(directory.path / "log"), "precious");
  EXPECT_THROW(LineFile(directory.path / "nowhere" / "log"), Failure);
  EXPECT_THROW(LineFile(directory.path.string()), Failure);
}

TEST(LineFile, RemovesPartOfLinesThatDoNotFit) {
  const Directory directory;
  LineFile file(directory.path / "log");
  file.append("whole line\n");
  // A file size limit simulates the full disk: the first part of the write succeeds.
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{16, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(file.append("another line\n"), Failure);
  EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(content(file.path()), "whole line\n");
  EXPECT_EQ(file.size(), 11u);
  file.append("again\n");
  EXPECT_EQ(content(file.path()), "whole line\nagain\n");
}

TEST(BlockFile, HasNoNameUntilItAppears) {
  const Directory directory;
  const fs::path path = directory.path / "log.h5";
  { BlockFile file(path); }
  EXPECT_TRUE(fs::is_empty(directory.path));
  BlockFile file(path);
  constexpr std::uint8_t bytes[] = {'o', 'n', 'e'};
  file.write(0, bytes);
  EXPECT_FALSE(fs::exists(path));
  file.appear();
  EXPECT_EQ(content(path), "one");
  EXPECT_THROW(BlockFile{path}, Failure);
  fs::remove(path);
  EXPECT_THROW(file.require_there(), Failure);
}

TEST(BlockFile, LeavesAFileThatTookItsNameMeanwhile) {
  const Directory directory;
  const fs::path path = directory.path / "log.h5";
  BlockFile file(path);
  std::ofstream(path) << "precious";
  try {
    file.appear();
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.kind(), Failure::Kind::in_use);
  }
  EXPECT_EQ(content(path), "precious");
}

TEST(LineFile, IsLostWhenItsPathLeadsElsewhere) {
  const Directory directory;
  const auto sentence = [&](const std::string& name, auto&& change) -> std::string {
    LineFile file(directory.path / name);
    file.append("one\n");
    file.require_there();
    change(directory.path / name);
    EXPECT_THROW(file.require_there(), Failure);
    EXPECT_THROW(file.sync(), Failure);
    try {
      file.append("two\n");
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.kind(), Failure::Kind::lost);
      return failure.what();
    }
    return "";
  };
  EXPECT_NE(sentence("a", [](const fs::path& path) { fs::remove(path); }).find("was removed"), std::string::npos);
  EXPECT_NE(sentence("b",
                     [](const fs::path& path) {
                       std::ofstream(path.string() + ".new") << "other\n";
                       fs::rename(path.string() + ".new", path);
                     })
                .find("replaced"),
            std::string::npos);
  EXPECT_EQ(content(directory.path / "b"), "other\n");
  EXPECT_NE(sentence("c", [](const fs::path& path) { fs::rename(path, path.string() + ".1"); }).find("moved away"),
            std::string::npos);
  EXPECT_EQ(content(directory.path / "c.1"), "one\n");
  EXPECT_NE(sentence("d", [](const fs::path& path) { fs::resize_file(path, 0); }).find("cut"), std::string::npos);
}

}  // namespace
}  // namespace absenc::os
