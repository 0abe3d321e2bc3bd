// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/lines/can_line.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "absenc/sim/can_bits.hpp"

namespace absenc::capture {
namespace {

/// A drawing of a CAN bus for tests: bits of any duration, with edges at whole ticks.
struct CanBusDrawing {
  explicit CanBusDrawing(double one_bit) : bit(one_bit) { pass(12); }

  void pass(std::size_t bits) { add(std::vector<bool>(bits, true)); }
  void add(const std::vector<bool>& bits) {
    for (const bool one : bits) {
      if (one != level) changes.at.push_back(static_cast<Tick>(std::llround(static_cast<double>(count) * bit)));
      level = one;
      ++count;
    }
  }
  Tick send(const CanFrame& frame) {
    const auto at = static_cast<Tick>(std::llround(static_cast<double>(count) * bit));
    add(sim::can_bits(frame));
    pass(sim::can_intermission_bits);
    return at;
  }
  [[nodiscard]] Tick end() const { return static_cast<Tick>(static_cast<double>(count) * bit); }
  [[nodiscard]] std::vector<CanRecord> decoded() const {
    CanDecoder decoder(bit);
    std::vector<CanRecord> frames;
    decoder.decode(changes, 0, end(), frames);
    decoder.finish(frames);
    return frames;
  }

  double bit;
  bool level = true;
  std::size_t count = 0;
  Changes changes{.before = true, .at = {}};
};

CanFrame any_frame(std::mt19937& random) {
  CanFrame frame;
  frame.extended = random() % 4 == 0;
  frame.id = static_cast<std::uint32_t>(random()) & (frame.extended ? 0x1FFFFFFF : 0x7FF);
  frame.remote = random() % 8 == 0;
  frame.size = static_cast<std::uint8_t>(random() % 9);
  const bool constant = random() % 4 == 0;  // equal data bytes cause many stuff bits
  for (std::size_t i = 0; i < frame.size && !frame.remote; ++i) {
    frame.data[i] = static_cast<std::uint8_t>(constant ? 0 : random());
  }
  return frame;
}

RC_GTEST_PROP(CanDecoderProperty, FindsEveryFrame, (std::uint32_t seed)) {
  std::mt19937 random(seed);
  CanBusDrawing bus(3 + static_cast<double>(random() % 4000) / 100);
  std::vector<std::pair<Tick, CanFrame>> sent;
  for (int i = 0; i < 50; ++i) {
    const CanFrame frame = any_frame(random);
    sent.emplace_back(bus.send(frame), frame);
    if (random() % 2 != 0) bus.pass(random() % 40);
  }
  const std::vector<CanRecord> frames = bus.decoded();
  RC_ASSERT(frames.size() == sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    RC_ASSERT(!frames[i].error_frame);
    RC_ASSERT(frames[i].at == sent[i].first);
    RC_ASSERT(frames[i].frame == sent[i].second);
  }
}

RC_GTEST_PROP(CanDecoderProperty, PartsMakeNoDifference, (std::uint32_t seed)) {
  std::mt19937 random(seed);
  CanBusDrawing bus(8);
  for (int i = 0; i < 20; ++i) bus.send(any_frame(random));
  CanDecoder decoder(bus.bit);
  Tick first = 0;
  std::vector<CanRecord> frames;
  for (std::size_t from = 0; from < bus.changes.at.size();) {
    const std::size_t to = std::min(bus.changes.at.size(), from + random() % 30);
    const auto begin = bus.changes.at.begin();
    const Tick end = to == bus.changes.at.size() ? bus.end() : bus.changes.at[to];
    const Changes part{from % 2 == 0,
                       {begin + static_cast<std::ptrdiff_t>(from), begin + static_cast<std::ptrdiff_t>(to)}};
    decoder.decode(part, first, end, frames);
    first = end;
    from = to;
  }
  decoder.finish(frames);
  const std::vector<CanRecord> whole = bus.decoded();
  RC_ASSERT(frames.size() == whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) RC_ASSERT(frames[i].frame == whole[i].frame);
}

RC_GTEST_PROP(CanDecoderProperty, AFlippedBitIsNoFrame, (std::uint32_t seed)) {
  std::mt19937 random(seed);
  CanBusDrawing bus(10);
  const CanFrame frame{.id = static_cast<std::uint32_t>(random()) & 0x7FF, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
  std::vector<bool> bits = sim::can_bits(frame);
  const std::size_t flipped = 1 + random() % (bits.size() - 8);
  bits[flipped] = !bits[flipped];
  bus.add(bits);
  bus.pass(20);
  bus.send({.id = 0x123});
  const std::vector<CanRecord> frames = bus.decoded();
  RC_ASSERT(!frames.empty());
  RC_ASSERT(frames.back().frame == (CanFrame{.id = 0x123}));
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) RC_ASSERT(frames[i].error_frame);
}

TEST(CanDecoder, ReportsMissingAcknowledge) {
  CanBusDrawing bus(10);
  std::vector<bool> bits = sim::can_bits({.id = 0x5});
  bits[bits.size() - 9] = true;
  bus.add(bits);
  bus.pass(20);
  const std::vector<CanRecord> frames = bus.decoded();
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_TRUE(frames[0].error_frame);
  EXPECT_EQ(frames[0].frame.id, 0x20u);
  EXPECT_EQ(text_of_error(frames[0].frame).substr(0, 19), "nobody acknowledged");
}

TEST(CanDecoder, ReportsPlaceOfError) {
  CanBusDrawing bus(10);
  std::vector<bool> bits = sim::can_bits({.id = 0x555, .size = 1, .data = {0x55}});
  bits[26] = !bits[26];  // inverts a bit of the data byte; its bits alternate, so no stuff bit changes
  bus.add(bits);
  bus.pass(20);
  const std::vector<CanRecord> frames = bus.decoded();
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].frame.id, 0x08u);
  EXPECT_TRUE(frames[0].frame.data[2] == 0x04 || frames[0].frame.data[3] == 0x08);
}

TEST(CanDecoder, ACaptureMayBeginAndEndInsideAFrame) {
  CanBusDrawing bus(10);
  std::vector<bool> bits = sim::can_bits({.id = 0x111, .size = 8});
  CanBusDrawing cut(10);
  cut.count = 0;
  cut.add(std::vector<bool>(bits.begin() + 20, bits.end()));
  cut.pass(3);
  cut.send({.id = 0x42});
  cut.add(std::vector<bool>(bits.begin(), bits.begin() + 30));
  const std::vector<CanRecord> frames = cut.decoded();
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].frame.id, 0x42u);
}

}  // namespace
}  // namespace absenc::capture
