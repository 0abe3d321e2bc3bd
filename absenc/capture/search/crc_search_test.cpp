// SPDX-License-Identifier: Apache-2.0
// Tests the search for checksums, mostly with frames whose CRC `crc_bitwise` of core computes.
#include "absenc/capture/search/crc_search.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <random>

#include "absenc/capture/search/polynomial.hpp"

namespace absenc::capture {
namespace {

struct GeneratedCheck {
  CrcParameters parameters{};
  bool low_first = true;
  bool padded = false;
  std::size_t first = 0;     // number of bytes in front of the bytes that the checksum covers
  std::size_t covered = 8;   // number of bytes that the checksum covers
  std::size_t trailing = 0;  // number of bytes behind the checksum
};

CheckedFrame frame_of(const GeneratedCheck& made, std::mt19937& random, std::size_t longer = 0) {
  CheckedFrame frame;
  const auto byte = [&random] { return static_cast<std::uint8_t>(random()); };
  for (std::size_t i = 0; i < made.first + made.covered + longer; ++i) frame.bytes.push_back(byte());
  std::vector<std::uint8_t> covered(frame.bytes.begin() + static_cast<std::ptrdiff_t>(made.first), frame.bytes.end());
  if (made.padded) covered.push_back(0);
  const std::uint16_t check = crc_bitwise(made.parameters, covered);
  const auto high = static_cast<std::uint8_t>(check >> 8);
  const auto low = static_cast<std::uint8_t>(check);
  if (made.parameters.width > 8) frame.bytes.push_back(made.low_first ? low : high);
  frame.bytes.push_back(made.parameters.width > 8 && made.low_first ? high : low);
  for (std::size_t i = 0; i < made.trailing; ++i) frame.bytes.push_back(byte());
  return frame;
}

std::vector<CheckedFrame> frames_of(const GeneratedCheck& made, std::size_t count, std::mt19937& random) {
  std::vector<CheckedFrame> frames;
  for (std::size_t i = 0; i < count; ++i) frames.push_back(frame_of(made, random));
  return frames;
}

// Returns whether `crc` over bytes equals the exclusive or of all bytes; the search reports it as exclusive or.
bool is_exclusive_or(const CrcParameters& crc) { return crc.width == 8 && crc.poly == 1 && crc.refin == crc.refout; }

bool describes(const CheckSolution& solution, const GeneratedCheck& made) {
  if (is_exclusive_or(made.parameters)) {
    return solution.kind == CheckKind::exclusive_or && solution.trailing == made.trailing &&
           solution.parameters.init == (made.parameters.init ^ made.parameters.xorout) &&
           std::find(solution.first.begin(), solution.first.end(), made.first) != solution.first.end();
  }
  return solution.kind == CheckKind::crc && solution.parameters == made.parameters &&
         (made.parameters.width <= 8 || solution.low_first == made.low_first) && solution.padded == made.padded &&
         solution.trailing == made.trailing &&
         std::find(solution.first.begin(), solution.first.end(), made.first) != solution.first.end();
}

bool found(const CheckSearch& search, const GeneratedCheck& made) {
  return std::any_of(search.solutions.begin(), search.solutions.end(),
                     [&](const CheckSolution& solution) { return describes(solution, made); });
}

constexpr CrcParameters esl_8{8, 0x2F, 0, true, true, 0};
constexpr CrcParameters esl_16_channel_2{16, 0x5935, 0xFFFF, true, true, 0};
constexpr CrcParameters rls{8, 0x97, 0, false, false, 0xFF};

TEST(CrcSearch, FindsChecksOfEslAndRlsFromFourFrames) {
  std::mt19937 random(1);
  for (const GeneratedCheck& made : {GeneratedCheck{.parameters = esl_8},
                                     GeneratedCheck{.parameters = esl_16_channel_2, .padded = true, .covered = 7},
                                     GeneratedCheck{.parameters = rls, .covered = 5}}) {
    const CheckSearch search = find_checks(frames_of(made, 4, random));
    ASSERT_FALSE(search.solutions.empty());
    EXPECT_TRUE(describes(search.solutions.front(), made)) << search.solutions.front().parameters.poly;
    EXPECT_EQ(frames_to_settle(search.solutions.front()), made.parameters.width == 16 ? 0u : 1u);
  }
}

TEST(CrcSearch, FindsCheckOfBissFromFourWords) {
  constexpr CrcParameters biss{6, 0x03, 0, false, false, 0x3F};
  std::mt19937 random(2);
  std::vector<CheckedFrame> frames;
  for (int i = 0; i < 4; ++i) {  // a word of 32 bits of position, error and warning, and a 6-bit CRC
    CheckedFrame frame;
    for (int k = 0; k < 4; ++k) frame.bytes.push_back(static_cast<std::uint8_t>(random()));
    frame.bytes.push_back(static_cast<std::uint8_t>(crc_bitwise(biss, frame.bytes) << 2));
    frame.bits = 38;
    frames.push_back(frame);
  }
  const CheckSearch search = find_checks(frames);
  ASSERT_FALSE(search.solutions.empty());
  EXPECT_EQ(search.solutions.front().parameters, biss);
  EXPECT_EQ(search.solutions.front().first.front(), 0u);
}

TEST(CrcSearch, AConstantAddressMayBeCoveredOrNot) {
  std::mt19937 random(3);
  std::vector<CheckedFrame> frames = frames_of({.parameters = esl_8, .first = 1}, 6, random);
  // the init of this CRC is 0, so a first byte 00 does not change the CRC, whether the CRC covers it or not
  for (CheckedFrame& frame : frames) frame.bytes.front() = 0;
  const CheckSearch search = find_checks(frames);
  ASSERT_FALSE(search.solutions.empty());
  EXPECT_EQ(search.solutions.front().parameters, esl_8);
  EXPECT_EQ(search.solutions.front().first, (std::vector<std::size_t>{0, 1}));
}

TEST(CrcSearch, SeparatesInitFromXoroutWithTwoLengths) {
  const GeneratedCheck made{.parameters = {8, 0x07, 0x55, false, false, 0x1A}};
  std::mt19937 random(4);
  std::vector<CheckedFrame> frames = frames_of(made, 4, random);
  const CheckSearch before = find_checks(frames);
  ASSERT_FALSE(before.solutions.empty());
  EXPECT_TRUE(before.solutions.front().init_open);
  for (std::size_t i = 0; i < 3; ++i) frames.push_back(frame_of(made, random, i + 1));
  const CheckSearch after = find_checks(frames);
  ASSERT_FALSE(after.solutions.empty());
  EXPECT_TRUE(describes(after.solutions.front(), made));
  EXPECT_FALSE(after.solutions.front().init_open);
}

TEST(CrcSearch, FramesOfDifferentLengthsOnlyAreTriedWithTheUsualInits) {
  const GeneratedCheck made{.parameters = {16, 0x8005, 0xFFFF, true, true, 0}};
  std::mt19937 random(5);
  std::vector<CheckedFrame> frames;
  for (std::size_t i = 0; i < 4; ++i) frames.push_back(frame_of(made, random, i));
  const CheckSearch search = find_checks(frames);
  ASSERT_FALSE(search.solutions.empty());
  EXPECT_TRUE(describes(search.solutions.front(), made));
}

TEST(CrcSearch, FindsASum) {
  std::mt19937 random(6);
  std::vector<CheckedFrame> frames;
  for (int i = 0; i < 5; ++i) {
    CheckedFrame frame{.bytes = {0xFF, 0x81, static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random())}};
    unsigned sum = 0;
    for (const std::uint8_t byte : frame.bytes) sum += byte;
    frame.bytes.push_back(static_cast<std::uint8_t>(sum));
    frames.push_back(frame);
  }
  const CheckSearch search = find_checks(frames);
  ASSERT_FALSE(search.solutions.empty());
  EXPECT_EQ(search.solutions.front().kind, CheckKind::sum);
  EXPECT_EQ(search.solutions.front().first.front(), 0u);
}

// Returns frames with slow positions. Their last byte is the exclusive or of the bytes from index `check_from` on.
std::vector<CheckedFrame> slow_positions(std::uint8_t check_from) {
  std::vector<CheckedFrame> frames;
  for (std::uint32_t i = 0; i < 8; ++i) {
    const std::uint32_t position = 0x0000A5A5 + 311 * i;
    CheckedFrame frame{.bytes = {0x40, 0x42, static_cast<std::uint8_t>(position >> 24),
                                 static_cast<std::uint8_t>(position >> 16), static_cast<std::uint8_t>(position >> 8),
                                 static_cast<std::uint8_t>(position)}};
    std::uint8_t check = check_from;
    for (const std::uint8_t byte : frame.bytes) check = static_cast<std::uint8_t>(check ^ byte);
    frame.bytes.push_back(check);
    frames.push_back(frame);
  }
  return frames;
}

TEST(CrcSearch, BytesThatNeverChangeProveNothing) {
  const CheckSearch search = find_checks(slow_positions(0));
  ASSERT_FALSE(search.solutions.empty());
  EXPECT_EQ(search.solutions.front().kind, CheckKind::exclusive_or);
  EXPECT_EQ(search.solutions.front().parameters.init, 0);
  EXPECT_EQ(search.solutions.front().first.front(), 0u);
  for (const CheckSolution& solution : search.solutions) {
    EXPECT_EQ(solution.trailing, 0u) << "the check at " << 6 - solution.trailing << " never changes";
  }
  const std::vector<CheckedFrame> few = slow_positions(0);
  EXPECT_GT(find_checks(std::span(few).first(3)).solutions.front().chance_log2,
            search.solutions.front().chance_log2 + 16);
}

TEST(CrcSearch, AnExclusiveOrIsFoundWithItsComplement) {
  const CheckSearch search = find_checks(slow_positions(0xFF));
  ASSERT_FALSE(search.solutions.empty());
  EXPECT_EQ(search.solutions.front().kind, CheckKind::exclusive_or);
  EXPECT_EQ(search.solutions.front().parameters.init, 0xFF);
}

TEST(CrcSearch, FindsExclusiveOrCrcInBothBitOrders) {
  for (const bool refin : {false, true}) {
    for (const bool refout : {false, true}) {
      std::mt19937 random(10);
      const GeneratedCheck made{.parameters = {8, 0x01, 0, refin, refout, 0xFF}, .covered = 11};
      EXPECT_TRUE(found(find_checks(frames_of(made, 5, random)), made)) << refin << refout;
    }
  }
}

TEST(CrcSearch, FramesThatDifferInOneWayOnlyCountOnce) {
  std::mt19937 random(9);
  const GeneratedCheck made{.parameters = esl_8};
  std::vector<CheckedFrame> frames = frames_of(made, 2, random);
  const double two = find_checks(frames).solutions.front().chance_log2;
  frames.push_back(frames[0]);
  frames.push_back(frames[1]);
  EXPECT_DOUBLE_EQ(find_checks(frames).solutions.front().chance_log2, two);
}

TEST(CrcSearch, NothingExplainsNoise) {
  std::mt19937 random(7);
  std::vector<CheckedFrame> frames(8);
  for (CheckedFrame& frame : frames) {
    for (int i = 0; i < 9; ++i) frame.bytes.push_back(static_cast<std::uint8_t>(random()));
  }
  EXPECT_TRUE(find_checks(frames).solutions.empty());
}

TEST(CrcSearch, ReportsTooLittleEvidence) {
  std::mt19937 random(8);
  std::vector<CheckedFrame> frames = frames_of({.parameters = esl_8, .covered = 16}, 2, random);
  EXPECT_NE(find_checks(frames).open, 0u);
  frames[1] = frames[0];
  const CheckSearch same = find_checks(frames);
  EXPECT_TRUE(same.solutions.empty());
  EXPECT_EQ(same.open, 0u);
}

RC_GTEST_PROP(CrcSearchProperty, FindsEveryCheckOf3To16Bits, (std::uint32_t seed)) {
  std::mt19937 random(seed);
  GeneratedCheck made;
  const unsigned width = *rc::gen::inRange<unsigned>(3, 17);
  const auto any = [&] { return static_cast<std::uint16_t>(random() & low_mask(width)); };
  const auto usual = [&] { return static_cast<std::uint16_t>(random() % 2 != 0 ? low_mask(width) : 0); };
  made.parameters = {width,  static_cast<std::uint16_t>(any() | 1), usual(), random() % 2 != 0, random() % 2 != 0,
                     usual()};
  made.low_first = random() % 2 != 0;
  made.padded = width > 8 && random() % 4 == 0;
  made.first = random() % 3;
  made.covered = 2 + random() % 10;
  made.trailing = random() % 3;
  RC_ASSERT(found(find_checks(frames_of(made, 3 + 16 / width, random)), made));
}

// Compares the divisors that `divisors` lists with those found by dividing by every polynomial that has the constant
// term 1.
RC_GTEST_PROP(PolynomialProperty, ListsAllDivisorsOnce, (std::uint64_t value)) {
  const unsigned degree = *rc::gen::inRange<unsigned>(1, 11);
  value |= 1;
  std::vector<std::uint32_t> expected;
  for (std::uint32_t one = (1u << degree) | 1; one < 2u << degree; one += 2) {
    Polynomial rest(value);
    static_cast<void>(rest.divide(Polynomial(one)));
    if (rest.degree() < 0) expected.push_back(one);
  }
  std::vector<std::uint32_t> found = divisors_of_degree(value, degree);
  std::sort(found.begin(), found.end());
  RC_ASSERT(found == expected);
}

TEST(Polynomial, DividesAcrossWords) {
  Polynomial product;  // the dividend is the product of the polynomials x^200 + x^7 + 1 and x^8 + x^2 + 1
  for (int i = 208; i >= 0; --i)
    product.append(i == 208 || i == 202 || i == 200 || i == 15 || i == 9 || i == 8 || i == 2 || i == 0 || i == 7);
  Polynomial rest = product;
  const Polynomial quotient = rest.divide(Polynomial(0x105));
  EXPECT_EQ(rest.degree(), -1);
  EXPECT_EQ(quotient.degree(), 200);
  EXPECT_EQ(greatest_common_divisor(product, Polynomial(0x105)), Polynomial(0x105));
}

}  // namespace
}  // namespace absenc::capture
