// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/candump.hpp"

#include <gtest/gtest.h>

#include "absenc/capture/files/test_files.hpp"

namespace absenc::capture {
namespace {

using Names = std::vector<std::string>;

CanFrame frame(std::uint32_t id, std::initializer_list<std::uint8_t> bytes, bool extended = false) {
  CanFrame made{.id = id, .extended = extended};
  for (const std::uint8_t byte : bytes) made.data[made.size++] = byte;
  return made;
}

TEST(Candump, Log) {
  const auto reader = open_text(
      "(1436509052.249713) vcan0 044#2A366C2B\n(1436509052.449847) can1 12345678#R\n"
      "(1436509052.449848) vcan0 7FF#R4\n(1436509053.649854321) vcan0 00000001#11.22.33 T\n"
      "(1436509053.700000) can1 20000004#0004000000000000\n(1436509053.8) can1 123#1122334455667788_9\n"
      "(1436509053.9) can1 123#\n");
  EXPECT_EQ(reader->layout().content, Content::frames);
  EXPECT_EQ(reader->layout().ticks_per_second, 1'000'000'000u);
  EXPECT_EQ(reader->layout().channels, (Names{"vcan0", "can1"}));
  const std::vector<CanRecord> frames = read_all(*reader).frames;
  ASSERT_EQ(frames.size(), 7u);
  EXPECT_EQ(frames[0].frame, frame(0x44, {0x2A, 0x36, 0x6C, 0x2B}));
  EXPECT_EQ(frames[0].at, 0u);
  EXPECT_EQ(frames[1].frame, (CanFrame{.id = 0x12345678, .extended = true, .remote = true}));
  EXPECT_EQ(frames[1].at, 200'134'000u);
  EXPECT_EQ(frames[1].channel, 1);
  EXPECT_EQ(frames[2].frame, (CanFrame{.id = 0x7FF, .remote = true, .size = 4}));
  EXPECT_EQ(frames[3].frame, frame(1, {0x11, 0x22, 0x33}, true));
  EXPECT_EQ(frames[3].at, 1'400'141'321u);
  EXPECT_TRUE(frames[4].error_frame);
  EXPECT_EQ(frames[4].frame.id, 4u);
  EXPECT_EQ(frames[5].frame.size, 8);
  EXPECT_EQ(frames[6].frame.size, 0);
  EXPECT_TRUE(reader->damages().empty());
}

TEST(Candump, Screen) {
  const auto reader = open_text(
      "  vcan0  123   [8]  11 22 33 44 55 66 77 88\n  vcan0  12345678   [0] \n  can0  RX - -  7FF   [2]  remote "
      "request\n"
      "  can0  TX - -  001   [2]  41 42   'AB'\n  can0  20000088   [8]  00 00 08 00 00 00 60 00   ERRORFRAME\n");
  EXPECT_EQ(reader->layout().ticks_per_second, 0u);
  const std::vector<CanRecord> frames = read_all(*reader).frames;
  ASSERT_EQ(frames.size(), 5u);
  EXPECT_EQ(frames[0].frame, frame(0x123, {0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88}));
  EXPECT_EQ(frames[1].frame, frame(0x12345678, {}, true));
  EXPECT_EQ(frames[2].frame, (CanFrame{.id = 0x7FF, .remote = true, .size = 2}));
  EXPECT_EQ(frames[3].frame, frame(1, {0x41, 0x42}));
  EXPECT_TRUE(frames[4].error_frame);
  EXPECT_EQ(frames[4].frame.id, 0x88u);
  EXPECT_TRUE(reader->damages().empty());
}

TEST(Candump, TimesOfAllKinds) {
  const auto times = [](std::string_view text) {
    std::vector<Tick> at;
    const auto reader = open_text(text);
    for (const CanRecord& record : read_all(*reader).frames) at.push_back(record.at);
    EXPECT_TRUE(reader->damages().empty());
    return at;
  };
  using Ticks = std::vector<Tick>;
  EXPECT_EQ(times(" (000.000000)  c  001   [0]\n (000.010000)  c  001   [0]\n (000.025000)  c  001   [0]\n"),
            // `candump -t z` prints these times, which count from the first frame on
            (Ticks{0, 10'000'000, 25'000'000}));
  EXPECT_EQ(times(" (000.000000)  c  001   [0]\n (000.010000)  c  001   [0]\n (000.005000)  c  001   [0]\n"),
            // `candump -t d` prints these times, each counted from the previous frame
            (Ticks{0, 10'000'000, 15'000'000}));
  EXPECT_EQ(times(" (000.000000)  c  001   [0]\n (000.010000)  c  001   [0]\n (000.010000)  c  001   [0]\n"),
            (Ticks{0, 10'000'000, 20'000'000}));
  EXPECT_EQ(times(" (000.000000)  c  001   [0]\n (000.010000)  c  001   [0]\n (000.010000)  d  001   [0]\n"),
            // the last two frames are of different interfaces, so the times may be equal
            (Ticks{0, 10'000'000, 10'000'000}));
  EXPECT_EQ(times(" (2026-11-21 17:55:24.000001)  c  001   [0]\n (2026-11-21 17:55:25.000000)  c  001   [0]\n"),
            (Ticks{0, 999'999'000}));  // `candump -t A` prints these times, which include the date
}

TEST(Candump, NotesFramesLeftOut) {
  const auto reader = open_text("(1.0) can0 123##1112233\n(2.0) can0 123#11\n(3.0) can0 123##0\n");
  EXPECT_EQ(read_all(*reader).frames.size(), 1u);
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_TRUE(reader->damages()[0].note);
  EXPECT_EQ(reader->damages()[0].what.substr(0, 8), "2 frames");
  const auto screen = open_text("  can0  123  [08]  11 22 33 44 55 66 77 88\n");
  EXPECT_TRUE(read_all(*screen).frames.empty());
  EXPECT_EQ(screen->damages().size(), 1u);
}

TEST(Candump, ReadsEverythingBeforeADamage) {
  for (const auto& [line, words] : std::vector<std::pair<std::string, std::string>>{
           {"(1.5) can0 123#11", "backwards"},
           {"(3.0) can0 123#1", "none that candump prints"},
           {"(3.0) can0 1234#11", "none that candump prints"},
           {"(3.0) can0 923#11", "none that candump prints"},
           {"(3.0) can0 123#112233445566778899", "none that candump prints"},
           {"(3.0) can0 123   [2]  11", "none that candump prints"},
           {"can0 123#11", "other than the first"},
           {"noise", "none that candump prints"},
       }) {
    const std::string good = "(100001.0) can0 001#AA\n(100002.0) can0 002#BB\n";
    const std::string bad = line.starts_with("(") ? "(10000" + line.substr(1) : line;
    const auto reader = open_text(good + bad + "\n(100009.0) can0 003#CC\n");
    EXPECT_EQ(read_all(*reader).frames.size(), 2u) << line;
    ASSERT_EQ(reader->damages().size(), 1u) << line;
    EXPECT_NE(reader->damages()[0].what.find(words), std::string::npos) << reader->damages()[0].what;
    EXPECT_EQ(reader->damages()[0].offset, good.size());
    EXPECT_EQ(reader->damages()[0].tick, 1'000'000'000u);
  }
}

TEST(Candump, ManyFramesAndALateInterface) {
  std::string text;
  for (unsigned i = 0; i < 50'000; ++i) {
    char line[64];
    std::snprintf(line, sizeof(line), "(1436509052.%06u) %s %03X#%02X\n", i, i == 40'000 ? "late" : "can0", i % 0x800,
                  i % 256);
    text += line;
  }
  const auto reader = open_text(text);
  const CaptureContents contents = read_all(*reader);
  EXPECT_GE(contents.blocks, 4u);
  ASSERT_EQ(contents.frames.size(), 49'999u);
  EXPECT_EQ(contents.frames[45'000].at, 45'001'000u);
  ASSERT_EQ(reader->damages().size(), 1u);
  EXPECT_NE(reader->damages()[0].what.find("late"), std::string::npos);
}

}  // namespace
}  // namespace absenc::capture
