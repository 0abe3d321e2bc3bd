// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/motion.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

namespace absenc::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t revolution = std::int64_t{1} << 32;
constexpr std::int64_t count_of_23_bits = revolution >> 23;

Motion path(const std::string& csv) {
  std::istringstream stream(csv);
  return Motion::path(0, stream, "motion.csv");
}

std::string refusal(auto&& action) {
  try {
    action();
  } catch (const std::invalid_argument& problem) {
    return problem.what();
  }
  return "no exception";
}

TEST(Motion, StillStaysAtItsStart) {
  const ShaftState state = Motion::still(-5).at(1h);
  EXPECT_EQ(state.position, -5);
  EXPECT_EQ(state.speed_millirpm, 0);
  EXPECT_EQ(state.acceleration, 0);
}

TEST(Motion, ConstantSpeedIsExactAfterADay) {
  const Motion motion = Motion::constant_speed(7, 6000);
  EXPECT_EQ(motion.at(24h).position, 7 + 6000 * 60 * 24 * revolution);
  EXPECT_EQ(motion.at(24h + 2500us).position, 7 + 6000 * 60 * 24 * revolution + revolution / 4);
  EXPECT_EQ(motion.at(24h).speed_millirpm, 6'000'000);
  EXPECT_EQ(Motion::constant_speed(0, -6000).at(24h).position, -6000 * 60 * 24 * revolution);
  EXPECT_EQ(motion.at(-10ms).position, 7 - revolution);
  // 1/3 rpm is stored as 0.333333: a day at this speed is 479.99952 revolutions.
  EXPECT_NEAR(static_cast<double>(Motion::constant_speed(0, 1.0 / 3).at(24h).position),
              479.99952 * static_cast<double>(revolution), 1.0 * count_of_23_bits);
}

TEST(Motion, ConstantSpeedWrapsInsteadOfOverflowing) {
  // At 1 000 000 rpm the position reaches 2^31 revolutions after 35.8 h.
  const Motion motion = Motion::constant_speed(0, 1'000'000);
  const auto wrapped = static_cast<std::int64_t>(60'000'000'000u * static_cast<std::uint64_t>(revolution));
  EXPECT_EQ(motion.at(1000h).position, wrapped);
}

TEST(Motion, BeginsAtSetTime) {
  Motion motion = Motion::constant_speed(0, 60);
  motion.begin_at(5s);
  EXPECT_EQ(motion.at(3s).position, 0);
  EXPECT_EQ(motion.at(5s).position, 0);
  // a shaft whose motion begins when the encoder is switched on has no speed before
  EXPECT_EQ(motion.at(5s).speed_millirpm, 0);
  EXPECT_EQ(motion.at(6s).position, revolution);
  EXPECT_EQ(motion.at(6s).speed_millirpm, 60'000);
}

TEST(Motion, SineHasExactPhaseAndDerivatives) {
  const Motion motion = Motion::sine(0, 90, 0.5);
  EXPECT_EQ(motion.at(0s).position, 0);
  EXPECT_EQ(motion.at(0s).speed_millirpm, 47'124);  // amplitude of the speed: pi/2 rad * pi rad/s = 47.1239 rpm
  EXPECT_EQ(motion.at(500ms).position, revolution / 4);
  EXPECT_EQ(motion.at(500ms).speed_millirpm, 0);
  // amplitude of the acceleration: pi/2 rad * (pi rad/s)^2 = 15.50 rad/s^2
  EXPECT_EQ(motion.at(500ms).acceleration, -16);
  EXPECT_EQ(motion.at(24h + 500ms).position, revolution / 4);
  EXPECT_EQ(motion.at(-500ms).position, -revolution / 4);
  EXPECT_EQ(motion.at(-500ms).acceleration, 16);
}

TEST(Motion, DerivativesAgreeWithPositions) {
  for (const Motion& motion : {Motion::sine(0, 7200, 3), Motion::constant_speed(0, 1234.5), path("0,0\n1,360\n3,0")}) {
    for (const Time time : {Time(10ms), Time(123ms), Time(777ms), Time(2s)}) {
      const auto before = static_cast<double>(motion.at(time - 5us).position);
      const auto here = static_cast<double>(motion.at(time).position);
      const auto after = static_cast<double>(motion.at(time + 5us).position);
      const double rpm = (after - before) / static_cast<double>(revolution) / 10e-6 * 60;
      EXPECT_NEAR(motion.at(time).speed_millirpm, rpm * 1e3, 2);
      const double radians = (after - 2 * here + before) / static_cast<double>(revolution) * 6.283185307;
      // Rounding changes the second difference of the positions by up to 2 * 2^-32 revolution, which is 117 rad/s^2.
      EXPECT_NEAR(motion.at(time).acceleration, radians / 25e-12, 120);
    }
  }
}

TEST(Motion, PathIsInterpolatedAndStandsStillOutside) {
  const Motion motion = path("# made by hand\r\n\nseconds,degrees\n0.5, 90\r\n 1.5,-90\n2.5 ,7200\n");
  EXPECT_EQ(motion.at(0s).position, revolution / 4);
  EXPECT_EQ(motion.at(0s).speed_millirpm, 0);
  EXPECT_EQ(motion.at(1s).position, 0);
  EXPECT_EQ(motion.at(1s).speed_millirpm, -30'000);
  EXPECT_EQ(motion.at(2500ms).position, 20 * revolution);
  EXPECT_EQ(motion.at(2500ms).speed_millirpm, 0);
  EXPECT_EQ(motion.at(24h).position, 20 * revolution);
}

TEST(Motion, BadPathNamesItsLine) {
  EXPECT_EQ(refusal([] { return path("0,0\n1;2\n"); }),
            "motion.csv, line 2: expected `seconds,degrees`, for example `0.5,90`");
  EXPECT_EQ(refusal([] { return path("t,deg\nt,deg\n0,0"); }),
            "motion.csv, line 2: expected `seconds,degrees`, for example `0.5,90`");
  EXPECT_EQ(refusal([] { return path("0,0\n\n1,5,6\n"); }),
            "motion.csv, line 3: expected `seconds,degrees`, for example `0.5,90`");
  EXPECT_EQ(refusal([] { return path("1,0\n1,5\n"); }), "motion.csv, line 2: the seconds must rise from line to line");
  EXPECT_EQ(refusal([] { return path("0,0\n# " + std::string(2000, 'x') + "\n1,5\n"); }),
            "motion.csv, line 2: more than 1024 characters");
  EXPECT_EQ(refusal([] { return path(std::string(2000, '\0')); }), "motion.csv, line 1: more than 1024 characters");
  EXPECT_EQ(refusal([] { return path("# nothing\n"); }), "motion.csv: no line with `seconds,degrees`");
  EXPECT_EQ(refusal([] { return path("1e300,0\n"); }),
            "motion.csv, line 1: expected `seconds,degrees`, for example `0.5,90`");
}

TEST(ParseMotion, EveryKind) {
  EXPECT_EQ(parse_motion("still", 42).at(1s).position, 42);
  EXPECT_EQ(parse_motion("rpm=-60", 1).at(1s).position, 1 - revolution);
  EXPECT_EQ(parse_motion("sine=180,0.25", 0).at(1s).position, revolution / 2);
  const std::string name = testing::TempDir() + "absenc_motion_test.csv";
  std::ofstream(name) << "0,0\n2,720\n";
  EXPECT_EQ(parse_motion("file=" + name, 3).at(1s).position, 3 + revolution);
  std::remove(name.c_str());
}

TEST(ParseMotion, ErrorStatesProblemAndAllowedValues) {
  EXPECT_EQ(refusal([] { return parse_motion("spin", 0); }),
            "motion `spin`: unknown; allowed are still, rpm=R, sine=DEGREES,HZ and file=CSV");
  EXPECT_EQ(refusal([] { return parse_motion("still=1", 0); }),
            "motion `still=1`: unknown; allowed are still, rpm=R, sine=DEGREES,HZ and file=CSV");
  EXPECT_EQ(refusal([] { return parse_motion("rpm=fast", 0); }),
            "motion `rpm=fast`: rpm= needs a number, for example `rpm=3000`");
  EXPECT_EQ(refusal([] { return parse_motion("rpm=+-5", 0); }),
            "motion `rpm=+-5`: rpm= needs a number, for example `rpm=3000`");
  EXPECT_EQ(refusal([] { return parse_motion("rpm=nan", 0); }),
            "motion `rpm=nan`: rpm= needs a number, for example `rpm=3000`");
  EXPECT_EQ(refusal([] { return parse_motion("rpm=1e7", 0); }),
            "motion `rpm=1e7`: the speed in rpm must be from -1000000 to 1000000");
  EXPECT_EQ(refusal([] { return parse_motion("sine=90", 0); }),
            "motion `sine=90`: sine= needs degrees and Hz, for example `sine=90,0.5`");
  EXPECT_EQ(refusal([] { return parse_motion("sine=90,-1", 0); }),
            "motion `sine=90,-1`: the frequency in Hz must be from 0 to 10000");
  EXPECT_EQ(refusal([] { return parse_motion("file=/nowhere/x.csv", 0); }),
            "motion `file=/nowhere/x.csv`: the file cannot be opened");
}

}  // namespace
}  // namespace absenc::sim
