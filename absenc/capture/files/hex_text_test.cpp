// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/hex_text.hpp"

#include <gtest/gtest.h>

#include "absenc/capture/files/test_files.hpp"

namespace absenc::capture {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Ticks = std::vector<Tick>;

Bytes values(std::string_view text) {
  const auto reader = open_text(text);
  EXPECT_EQ(reader->layout().content, Content::bytes);
  Bytes bytes;
  for (const Character& one : read_all(*reader).bytes) bytes.push_back(one.value);
  EXPECT_TRUE(reader->damages().empty()) << text << reader->damages()[0].what;
  return bytes;
}

TEST(HexText, PlainBytesInAnyWriting) {
  const Bytes expected = {0x1A, 0x00, 0x35};
  for (const char* text : {"1A 00 35", "1a0035\n", "0x1A,0x00, 0x35", "0x1A,0x0,0x35\r\n", "\\x1A\\x00\\x35",
                           "$1A $00 $35", "1A;00;35;", "# three\n\n1A 00 # two\n35 // one\n", "0x1A0035"}) {
    EXPECT_EQ(values(text), expected) << text;
  }
}

TEST(HexText, WithoutTimesEachByteIsATick) {
  const auto reader = open_text("1A 00\n35");
  EXPECT_EQ(reader->layout().ticks_per_second, 0u);
  EXPECT_TRUE(reader->layout().channels.empty());
  const CaptureContents contents = read_all(*reader);
  ASSERT_EQ(contents.bytes.size(), 3u);
  EXPECT_EQ(contents.bytes[2].begin, 2u);
  EXPECT_EQ(contents.end, 3u);
}

TEST(HexText, Dumps) {
  Bytes expected;
  for (unsigned i = 0; i < 20; ++i) expected.push_back(static_cast<std::uint8_t>(i * 13));
  EXPECT_EQ(values("00000000  00 0d 1a 27 34 41 4e 5b  68 75 82 8f 9c a9 b6 c3  |...'4AN[hu......|\n"
                   "00000010  d0 dd ea f7                                       |....|\n00000014\n"),
            expected);
  EXPECT_EQ(
      values("00000000: 000d 1a27 3441 4e5b 6875 828f 9ca9 b6c3  ...'4AN[hu......\n00000010: d0dd eaf7        ..//\n"),
      expected);
  EXPECT_EQ(values("000000 00 0d 1a 27 34 41 4e 5b 68 75 82 8f 9c a9 b6 c3\n000010 d0 dd ea f7\n000014\n"), expected);
}

TEST(HexText, DumpsThatHideBytes) {
  const auto star = open_text("00000000  00 00 |..|\n*\n00000010  11 22 |..|\n");
  EXPECT_EQ(read_all(*star).bytes.size(), 2u);
  ASSERT_EQ(star->damages().size(), 1u);
  EXPECT_NE(star->damages()[0].what.find("-v"), std::string::npos);
  const auto jump = open_text("00000000: 0011  ..\n00000010: 2233  ..\n00000020: 44  .\n");
  EXPECT_EQ(read_all(*jump).bytes.size(), 5u);
  ASSERT_EQ(jump->damages().size(), 1u);
  EXPECT_TRUE(jump->damages()[0].note);
  EXPECT_EQ(jump->damages()[0].offset, 19u);
}

TEST(HexText, TimesAndDirections) {
  for (const char* text : {
           "12.000250 tx 1A\n12.0003 rx 1A 00\n12.001 < 35\n",
           "[12.000250] > 1A\n[12.000300] < 1A 00\n[12.001] in: 35\n",
           "250us: TX: 1A\n300us: RX: 1A00\n1ms [rx] 35\n",
           "17:55:24.000250 --> 1A\n17:55:24.000300 <-- 1A 00\n17:55:24.001 <-- 35\n",
           "2026-11-21T23:59:59.999950Z out 1A\n2026-11-22T00:00:00Z in 1A 00\n2026-11-22T00:00:00.000700Z in 35\n",
           "2026-11-21 23:59:59.999950 host 1A\n[2026-11-22 00:00:00] device 1A 00\n2026-11-22 00:00:00.000700 device "
           "35\n",
       }) {
    const auto reader = open_text(text);
    EXPECT_EQ(reader->layout().ticks_per_second, 1'000'000'000u);
    EXPECT_EQ(reader->layout().channels, (std::vector<std::string>{"tx", "rx"}));
    const CaptureContents contents = read_all(*reader);
    EXPECT_TRUE(reader->damages().empty()) << text;
    ASSERT_EQ(contents.bytes.size(), 4u) << text;
    EXPECT_EQ(contents.bytes[0].channel, 0);
    EXPECT_EQ(contents.bytes[1].channel, 1);
    EXPECT_EQ(contents.bytes[1].begin, 50'000u);
    EXPECT_EQ(contents.bytes[2].begin, 50'000u);
    EXPECT_EQ(contents.bytes[3].begin, 750'000u);
    EXPECT_EQ(contents.bytes[3].value, 0x35);
  }
  EXPECT_EQ(values("> 1A\n< 1A 00"), (Bytes{0x1A, 0x1A, 0x00}));
}

TEST(HexText, LogsOfTerminals) {
  const Bytes expected = {0x1A, 0x00, 0x35};
  for (const char* line : {
           "COM3: 1A 00 35",
           "[COM3] 1A 00 35",
           "COM3 1A,00,35",
           "COM3> 1A 00 35",
           "17:55:24.123 COM3 RX 1A 00 35",
           "17:55:24,123 [COM3] <- 0x1A 0x00 0x35",
           "17:55:24:123 COM3: << 1A0035",
           "[17:55:24.123] [COM3] [RX] 1A 00 35",
           "[17:55:24.123 COM3 RX] 1A 00 35",
           "[2026-11-21 17:55:24.123] COM3 Rx: 1a 00 35   ..5",
           "21.11.2026 17:55:24.123 COM3 [RX] - 1A 00 35",
           "11/21/2026 5:55:24 PM COM3 Received 1A 00 35",
           "2026/11/21 17:55:24 (COM3) read 3 bytes: 1A 00 35",
           "17:55:24.123;COM3;RX;1A 00 35;",
           "17:55:24,COM3,RX,1A,00,35",
           "17:55:24,1A,00,35",
           "17:55:24.123 | COM3 | RX | 1A 00 35 | ..5 |",
           "2026-11-21T17:55:24.123Z COM3 RX len=3 1A-00-35",
           "COM3 RX [3] 1A:00:35",
           "12: COM3 RX 1A 00 35 |..5|",
           "12 17:55:24.123 COM3 RX 1A 00 35",
           "/dev/ttyUSB0 rx 1A 00 35  \"..5\"",
           "RX1: 1A 00 35\t\xC2\xB7\xC2\xB7"
           "5",
           "17:55:24.123 DEBUG: COM3 > 1A 00 35 // a comment",
           "0.000123 COM3 < 1A 00 35",
       }) {
    EXPECT_EQ(values(line), expected) << line;
  }
  EXPECT_EQ(values("COM3: 20 3D 20   = "), (Bytes{0x20, 0x3D, 0x20}));
  EXPECT_EQ(values("COM3: 1A 23 35  .#5"), (Bytes{0x1A, 0x23, 0x35}));
}

TEST(HexText, TimesOfTerminals) {
  for (const char* text :
       {"17:55:24,100 COM3 RX 1A\n17:55:25,350 COM3 RX 35\n", "5:59:59.750 AM: 1A\n6:00:01 AM: 35\n",
        "11:59:59.750 PM rx 1A\n11:60:01 PM rx 35\n", "11/21/2026 11:59:59.750 PM 1A\n11/22/2026 12:00:01 AM 35\n",
        "[21.11.2026 23:59:59:750] 1A\n[22.11.2026 00:00:01] 35\n"}) {
    const auto reader = open_text(text);
    const CaptureContents contents = read_all(*reader);
    if (std::string_view(text).find("11:60") != std::string_view::npos) {
      EXPECT_EQ(reader->damages().size(), 1u) << text;
      continue;
    }
    EXPECT_TRUE(reader->damages().empty()) << text;
    ASSERT_EQ(contents.bytes.size(), 2u) << text;
    EXPECT_EQ(contents.bytes[1].begin, 1'250'000'000u) << text;
  }
}

TEST(HexText, RefusesAmbiguousLogs) {
  const auto why = [](const char* text) -> std::string {
    try {
      const auto reader = open_text(text);
      static_cast<void>(read_all(*reader));
      return reader->damages().empty() ? "" : reader->damages()[0].what;
    } catch (const OpenError& error) {
      return error.what();
    }
  };
  struct Ambiguous {
    const char* text;
    const char* word;
  };
  for (const Ambiguous& one : {Ambiguous{"12:00:35", "may be a time or bytes"},
                               {"31 32  12", "may be bytes, or the text"},
                               {"31 32\t12", "may be bytes, or the text"},
                               {"RX <- 1A\nRX -> 1A\n", "two directions"},
                               {"[1A 00] 35", "in brackets"},
                               {"[COM3 1A 00 35", "nothing closes"},
                               {"COM3 hello 1A 00", "\"hello\" before the bytes"},
                               {"COM3 opened at 115200 8N1", "\"opened\" before the bytes"},
                               {"COM3: 1A 00  zz", "neither bytes nor the text"},
                               {"COM3: 1A 00  ...", "neither bytes nor the text"},
                               {"COM3: 1A 00\nCOM4: 35\n", "of \"COM4\", the first of \"COM3\""},
                               {"COM3: 1A 00\n35\n", "of \"\""},
                               {"35 34 4", "neither bytes"},
                               {"35 34  4", "neither bytes"},
                               {"COM3: 1A 0\n", "neither bytes"}}) {
    EXPECT_NE(why(one.text).find(one.word), std::string::npos) << one.text << ": " << why(one.text);
  }
}

TEST(HexText, SigroksDecoder) {
  EXPECT_EQ(values("uart-1: 1A\nuart-1: 35\n"), (Bytes{0x1A, 0x35}));
  const auto reader = open_text(
      "200-210 uart-1: Start bit\n210-220 uart-1: 0\n210-290 uart-1: rx-data: 1A\n310-390 uart-1: tx-data: 35\n"
      "400-410 uart-1: rx-stop-bits: Stop bit\n",
      {.samples_per_second = 96'000});
  EXPECT_EQ(reader->layout().ticks_per_second, 96'000u);
  const CaptureContents contents = read_all(*reader);
  EXPECT_TRUE(reader->damages().empty());
  ASSERT_EQ(contents.bytes.size(), 2u);
  EXPECT_EQ(contents.bytes[0].begin, 210u);
  EXPECT_EQ(contents.bytes[0].end, 290u);
  EXPECT_EQ(contents.bytes[0].value, 0x1A);
  EXPECT_EQ(contents.bytes[0].channel, 1);
  EXPECT_EQ(contents.bytes[1].channel, 0);
}

TEST(HexText, ReadsEverythingBeforeADamage) {
  for (const char* line : {"1A 0", "1A xx", "0.5 tx 00", "5.0 00", "rx 00", "5.0 rx zz"}) {
    const std::string good = "1.0 tx 11\n2.0 rx 22 33\n";
    const auto reader = open_text(good + line + "\n9.0 tx 44\n");
    EXPECT_EQ(read_all(*reader).bytes.size(), 3u) << line;
    ASSERT_EQ(reader->damages().size(), 1u) << line;
    EXPECT_EQ(reader->damages()[0].offset, good.size()) << line;
    EXPECT_EQ(reader->damages()[0].tick, 1'000'000'000u) << line;
  }
}

TEST(HexText, LongLinesAndManyBlocks) {
  std::string text;
  for (unsigned i = 0; i < 300'000; ++i) text += "5A ";
  EXPECT_EQ(values(text).size(), 300'000u);
  std::string lines;
  for (unsigned i = 0; i < 30'000; ++i) lines += "00 11 22 33 44 55 66 77\n";
  const auto reader = open_text(lines);
  const CaptureContents contents = read_all(*reader);
  EXPECT_EQ(contents.bytes.size(), 240'000u);
  EXPECT_GE(contents.blocks, 3u);
  EXPECT_EQ(contents.bytes[239'999].begin, 239'999u);
}

TEST(HexText, AnythingElseIsRefused) {
  for (const char* text : {"hello", "1A 0", "# only a comment\n", "1A 00 hello", "\x01\x02"}) {
    EXPECT_THROW(static_cast<void>(open_text(text)), OpenError) << text;
  }
}

}  // namespace
}  // namespace absenc::capture
