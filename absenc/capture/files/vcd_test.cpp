// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/vcd.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>

#include "absenc/capture/files/test_files.hpp"

namespace absenc::capture {
namespace {

using testing::Test;
using Ticks = std::vector<Tick>;
using Names = std::vector<std::string>;

std::string with_header(std::string_view body) {
  return "$timescale 10 ns $end\n$var wire 1 ! tx $end\n$var wire 1 \" rx $end\n$enddefinitions $end\n" +
         std::string(body);
}

std::string problem(std::string_view text) {
  try {
    static_cast<void>(open_text(text));
  } catch (const OpenError& error) {
    return error.what();
  }
  return "opened";
}

TEST(Vcd, LevelsAndTimes) {
  const auto reader = open_text(with_header("#0\n$dumpvars\n1!\n0\"\n$end\n#7 0!\n#9 1! 1\"\n#9 0!\n#20\n"));
  EXPECT_EQ(reader->layout().ticks_per_second, 100'000'000u);
  EXPECT_EQ(reader->layout().channels, (Names{"tx", "rx"}));
  const CaptureContents contents = read_all(*reader);
  EXPECT_TRUE(contents.changes[0].before);
  // two changes of the same wire at tick 9 cancel each other, so no change is read
  EXPECT_EQ(contents.changes[0].at, (Ticks{7}));
  EXPECT_FALSE(contents.changes[1].before);
  EXPECT_EQ(contents.changes[1].at, (Ticks{9}));
  EXPECT_EQ(contents.end, 20u);
  EXPECT_TRUE(reader->damages().empty());
}

// A source of a large file that is not in memory: a text that is repeated many times, then another text.
class Repeated final : public Source {
 public:
  Repeated(std::string part, std::uint64_t count, std::string last)
      : part_(std::move(part)), last_(std::move(last)), repeated_(count * part_.size()) {}
  [[nodiscard]] std::uint64_t size() const override { return repeated_ + last_.size(); }
  [[nodiscard]] std::size_t read(std::uint64_t offset, std::span<std::uint8_t> into) override {
    std::size_t done = 0;
    for (; done < into.size() && offset + done < size(); ++done) {
      const std::uint64_t at = offset + done;
      into[done] = static_cast<std::uint8_t>(at < repeated_ ? part_[at % part_.size()] : last_[at - repeated_]);
    }
    return done;
  }

 private:
  std::string part_;
  std::string last_;
  std::uint64_t repeated_;
};

std::unique_ptr<Reader> open_repeated(const std::string& part) {
  return read_vcd(
      std::make_unique<Repeated>(part, (std::uint64_t{70} << 20) / part.size(), with_header("#0 1! 0\"\n#7 0!\n#20\n")),
      "long.vcd");
}

// Checks that 70 MiB of comments are skipped, although a header must otherwise be shorter.
TEST(Vcd, AnyNumberOfCommentsBeforeTheChanges) {
  const auto reader = open_repeated("$comment #123456789012 device 1A and 0 more words like these in between $end\n");
  const CaptureContents contents = read_all(*reader);
  EXPECT_EQ(contents.changes[0].at, (Ticks{7}));
  EXPECT_EQ(contents.end, 20u);
  EXPECT_TRUE(reader->damages().empty());
}

TEST(Vcd, AHeaderThatNeverEndsIsRefused) {
  try {
    static_cast<void>(open_repeated("$version and words and words and words and words and words and words $end\n"));
    FAIL();
  } catch (const OpenError& error) {
    EXPECT_NE(std::string_view(error.what()).find("header of more than 64 MiB"), std::string_view::npos);
  }
}

TEST(Vcd, ScopesMayNotNestForEver) {
  std::string deep;
  for (int i = 0; i < 50'000; ++i) deep += "$scope begin x $end ";
  EXPECT_NE(problem(deep).find("1000 deep"), std::string::npos);
}

TEST(Vcd, BeginsAtItsFirstTime) {
  const auto reader = open_text(with_header("#1000 1! 0\"\n#1001 0!"));
  const CaptureContents contents = read_all(*reader);
  EXPECT_EQ(contents.first, 1000u);
  EXPECT_EQ(contents.end, 1002u);
  EXPECT_TRUE(contents.changes[0].before);
  EXPECT_EQ(contents.changes[0].at, (Ticks{1001}));
}

TEST(Vcd, VectorsAndNames) {
  const auto reader = open_text(
      "$comment a capture $end $timescale 1ps $end $scope module top $end $var reg 4 ! bus [3:0] $end\n"
      "$var wire 1 % clk $end $scope module a $end $var wire 1 & clk $end $var wire 3 ' up[0:2] $end $upscope $end\n"
      "$var wire 1 ( one [5] $end $var real 64 ) level $end $var wire 1 % alias $end $upscope $end\n"
      "$enddefinitions $end #0 b0 ! 0% 0& b0 ' 0( r1.5 ) #5 b1010 ! b1 ' #6 b1 ! 1% #7 b100 '");
  EXPECT_EQ(reader->layout().channels, (Names{"bus[0]", "bus[1]", "bus[2]", "bus[3]", "top.clk", "top.a.clk", "up[2]",
                                              "up[1]", "up[0]", "one[5]", "alias"}));
  const CaptureContents contents = read_all(*reader);
  const std::vector<Ticks> expected = {{6}, {5, 6}, {}, {5, 6}, {6}, {}, {5, 7}, {}, {7}, {}, {6}};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(contents.changes[i].at, expected[i]) << i;
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_TRUE(reader->damages()[0].note);
}

TEST(Vcd, UnknownValuesKeepTheLevel) {
  const auto reader = open_text(with_header("#0 x! 1\"\n#3 1!\n#4 z!\n#5 1!\n#6 bx \"\n#7 0\"\n"));
  const CaptureContents contents = read_all(*reader);
  EXPECT_EQ(contents.changes[0].at, (Ticks{3}));
  EXPECT_EQ(contents.changes[1].at, (Ticks{7}));
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_TRUE(reader->damages()[0].note);
  EXPECT_EQ(reader->damages()[0].tick, 0u);
  EXPECT_EQ(reader->damages()[0].what.substr(0, 2), "3 ");
}

TEST(Vcd, ReadsEverythingBeforeADamage) {
  for (const auto& [body, words] : std::vector<std::pair<std::string, std::string>>{
           {"#5 0!\n#9 1!\n#8 0!\n#20 1!", "from 9 to 8"},
           {"#5 0!\n#9 1!\n0@\n#20 1!", "no such identifier"},
           {"#5 0!\n#9 1!\n?!\n#20 1!", "no value change"},
           {"#5 0!\n#9 1!\n#1x\n#20 1!", "no time"},
           {"#5 0!\n#9 1!\nb1y \"\n#20 1!", "a bit that is none"},
           {"#5 0!\n#9 1!\n$comment\n#20 1!", "within a section"},
       }) {
    const std::string file = with_header("#0 1!\n" + body);
    const auto reader = open_text(file);
    const CaptureContents contents = read_all(*reader);
    EXPECT_EQ(contents.changes[0].at, (Ticks{5, 9})) << body;
    EXPECT_EQ(contents.end, 10u) << body;
    ASSERT_EQ(reader->damages().size(), 1u) << body;
    EXPECT_NE(reader->damages()[0].what.find(words), std::string::npos) << reader->damages()[0].what;
    EXPECT_GT(reader->damages()[0].offset, file.find("#9")) << body;
    EXPECT_EQ(reader->damages()[0].tick, 9u) << body;
  }
}

TEST(Vcd, RefusesInvalidHeaders) {
  EXPECT_NE(problem("$timescale 1 us $end $var wire 1 ! a $end").find("cut off"), std::string::npos);
  EXPECT_NE(problem("$var wire 1 ! a $end $enddefinitions $end #0 1!").find("no $timescale"), std::string::npos);
  EXPECT_NE(problem("$timescale 3 us $end $enddefinitions $end").find("1, 10 or 100"), std::string::npos);
  EXPECT_NE(problem("$timescale 1 us $end $enddefinitions $end").find("no channels"), std::string::npos);
  EXPECT_NE(problem("$timescale 1 us $end $var wire 999999999 ! a $end").find("impossible width"), std::string::npos);
}

// Checks a file with many blocks, words across the read buffer's borders, and long identifiers.
TEST(Vcd, LargeFiles) {
  std::string text = "$timescale 1 ns $end\n";
  constexpr std::size_t channels = 300;
  const auto identifier = [](std::size_t i) {
    const auto letter = static_cast<char>('!' + i % 90);
    return i % 3 == 0 ? std::string{letter, 'a', static_cast<char>('!' + i / 90)}
                      : std::string{letter, static_cast<char>('!' + i / 90)};
  };
  for (std::size_t i = 0; i < channels; ++i) {
    text += "$var wire 1 " + identifier(i) + " n" + std::to_string(i) + " $end\n";
  }
  text += "$enddefinitions $end\n#0\n";
  for (std::size_t i = 0; i < channels; ++i) text += "0" + identifier(i) + "\n";
  std::vector<Ticks> expected(channels);
  std::mt19937 random(3);
  Tick time = 0;
  while (text.size() < 5'000'000) {
    time += 1 + random() % 50;
    text += "#" + std::to_string(time) + "\n";
    const std::size_t channel = random() % channels;
    text += (expected[channel].size() % 2 == 0 ? "1" : "0") + identifier(channel) + "\n";
    expected[channel].push_back(time);
  }
  const auto reader = open_text(text);
  const CaptureContents contents = read_all(*reader);
  EXPECT_GE(contents.blocks, 4u);
  for (std::size_t i = 0; i < channels; ++i) ASSERT_EQ(contents.changes[i].at, expected[i]) << i;
  EXPECT_TRUE(reader->damages().empty());
}

}  // namespace
}  // namespace absenc::capture
