// SPDX-License-Identifier: Apache-2.0
#include "absenc/link/slcan.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

namespace absenc::slcan {
namespace {

std::string text(const LineText& line) { return {line.view().begin(), line.view().end()}; }
Bytes bytes(std::string_view text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

const CanFrame position{.id = 0x120, .size = 8, .data = {0x47, 0x26}};

TEST(Slcan, EncodesFramesLikeAdapters) {
  EXPECT_EQ(text(encode(position)), "t12084726000000000000\r");
  EXPECT_EQ(text(encode({.id = 0x18DAF110, .extended = true, .size = 2, .data = {1, 0xAB}})), "T18DAF110201AB\r");
  EXPECT_EQ(text(encode({.id = 0x7FF, .remote = true, .size = 8})), "r7FF8\r");
  EXPECT_EQ(text(encode({.id = 1, .extended = true, .remote = true})), "R000000010\r");
  EXPECT_EQ(text(encode({.id = 0x80}, 0xEA5F)), "t0800EA5F\r");
  EXPECT_EQ(encode({.id = 0x1FFFFFFF, .extended = true, .size = 8}, 0).size(), line_capacity);
}

TEST(Slcan, DecodesEncodedFrames) {
  for (const bool extended : {false, true}) {
    for (const bool remote : {false, true}) {
      for (std::uint8_t size = 0; size <= 8; ++size) {
        CanFrame frame{.id = extended ? 0x1ABCDEF0u : 0x5A5u, .extended = extended, .remote = remote, .size = size};
        for (std::uint8_t i = 0; i < size && !remote; ++i) frame.data[i] = static_cast<std::uint8_t>(0xF0 + i);
        for (const bool with_time : {false, true}) {
          const LineText line = with_time ? encode(frame, 1234) : encode(frame);
          const Result<CanFrame> read = decode(line.view().first(line.size() - 1));
          ASSERT_TRUE(read);
          EXPECT_EQ(*read, frame);
        }
      }
    }
  }
}

TEST(Slcan, RefusesInvalidLines) {
  const std::pair<std::string_view, Error> cases[] = {{"", Error::bad_framing},
                                                      {"V1013", Error::bad_framing},
                                                      {"t", Error::wrong_length},
                                                      {"t120", Error::wrong_length},
                                                      {"t1g00", Error::bad_framing},
                                                      {"t120x", Error::bad_framing},
                                                      {"t8000", Error::out_of_range},
                                                      {"t1209", Error::out_of_range},
                                                      {"T200000000", Error::out_of_range},
                                                      {"t120147", Error::none},
                                                      {"t12014", Error::wrong_length},
                                                      {"t1201471", Error::wrong_length},
                                                      {"t12014712345", Error::wrong_length},
                                                      {"t1201471234", Error::none},
                                                      {"t120147123g", Error::bad_framing},
                                                      {"t1201g7", Error::bad_framing},
                                                      {"r12084726000000000000", Error::wrong_length},
                                                      {"r1208", Error::none},
                                                      {"T00000120", Error::wrong_length},
                                                      {"t120 0", Error::bad_framing}};
  for (const auto& [line, error] : cases) EXPECT_EQ(decode(bytes(line)).error(), error) << line;
}

TEST(Slcan, MapsBitRatesToCodes) {
  EXPECT_EQ(rate_code(250'000), '5');
  EXPECT_EQ(rate_code(500'000), '6');
  EXPECT_EQ(rate_code(1'000'000), '8');
  EXPECT_FALSE(rate_code(123'456));
  EXPECT_EQ(rate_of('8'), 1'000'000u);
  EXPECT_EQ(rate_of('9'), 0u);
}

// Returns the lines that are found in `stream`, and "refused" or "garbage" for these events.
std::vector<std::string> found(std::string_view stream) {
  LineReader reader;
  std::vector<std::string> all;
  for (const std::uint8_t byte : bytes(stream)) {
    switch (reader.feed(byte)) {
      case LineReader::LineEvent::nothing:
        break;
      case LineReader::LineEvent::line:
        all.emplace_back(reader.line().begin(), reader.line().end());
        break;
      case LineReader::LineEvent::refused:
        all.emplace_back("refused");
        break;
      case LineReader::LineEvent::garbage:
        all.emplace_back("garbage");
        break;
    }
  }
  return all;
}

TEST(SlcanReader, SplitsLinesAndRefusals) {
  using Lines = std::vector<std::string>;
  EXPECT_EQ(found("\rz\r\at1200\rV1013\r"), (Lines{"", "z", "refused", "t1200", "V1013"}));
  EXPECT_EQ(found("z\r\nt1200\r\n"), (Lines{"z", "t1200"}));
  EXPECT_EQ(found("t12"), Lines{});
}

TEST(SlcanReader, ResumesAfterGarbage) {
  using Lines = std::vector<std::string>;
  EXPECT_EQ(found("xyt1200\r"), (Lines{"garbage", "t1200"}));
  // The CR at the end of the first frame's line was lost.
  EXPECT_EQ(found("t12084726t1200\rt0800\r"), (Lines{"garbage", "t1200", "t0800"}));
  const std::string endless(100, '5');
  EXPECT_EQ(found(endless + "\rt1200\r"), (Lines{"garbage", "t1200"}));
  EXPECT_EQ(found(endless + "t1200\r"), (Lines{"garbage", "t1200"}));
}

}  // namespace
}  // namespace absenc::slcan
