// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/input_lines.hpp"

#include <fcntl.h>
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <string_view>

#include "absenc/os/descriptor.hpp"

namespace absenc::os {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

struct Pipe {
  Pipe() {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
    out = Descriptor(ends[0]);
    in = Descriptor(ends[1]);
  }
  void write(std::string_view text) const {
    EXPECT_EQ(::write(in.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  Descriptor out;
  Descriptor in;
};

TEST(InputLines, TakesWholeLinesAndDoesNotWait) {
  const Pipe pipe;
  InputLines lines(pipe.out.get());
  EXPECT_THAT(lines.take(), IsEmpty());
  pipe.write("power off\nbatt");
  EXPECT_THAT(lines.take(), ElementsAre("power off"));
  EXPECT_THAT(lines.take(), IsEmpty());
  pipe.write("ery=0\n\nhelp\n");
  EXPECT_THAT(lines.take(), ElementsAre("battery=0", "", "help"));
  EXPECT_FALSE(lines.ended());
}

TEST(InputLines, EndOfInputEndsLastLine) {
  Pipe pipe;
  InputLines lines(pipe.out.get());
  pipe.write("help");
  EXPECT_THAT(lines.take(), IsEmpty());
  pipe.in = Descriptor();
  EXPECT_THAT(lines.take(), ElementsAre("help"));
  EXPECT_TRUE(lines.ended());
  EXPECT_THAT(lines.take(), IsEmpty());
}

TEST(InputLines, CutsInputWithoutLines) {
  const Descriptor zeros(::open("/dev/zero", O_RDONLY | O_CLOEXEC));
  InputLines lines(zeros.get());
  EXPECT_THAT(lines.take(), ElementsAre(SizeIs(4096)));
  EXPECT_FALSE(lines.ended());
}

TEST(InputLines, LongestLineIsOneLine) {
  const Pipe pipe;
  InputLines lines(pipe.out.get());
  pipe.write(std::string(4096, 'x') + "\n");
  std::vector<std::string> taken = lines.take();
  pipe.write("\nhelp\n");
  for (std::string& line : lines.take()) taken.push_back(std::move(line));
  if (taken.size() == 2) {
    for (std::string& line : lines.take()) taken.push_back(std::move(line));
  }
  EXPECT_THAT(taken, ElementsAre(SizeIs(4096), "", "help"));
}

TEST(InputLines, UnreadableInputHasEnded) {
  const Descriptor folder(::open("/", O_RDONLY | O_CLOEXEC));
  InputLines lines(folder.get());
  EXPECT_THAT(lines.take(), IsEmpty());
  EXPECT_TRUE(lines.ended());
}

}  // namespace
}  // namespace absenc::os
