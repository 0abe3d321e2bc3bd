// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/extrapolation.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

namespace absenc::host {
namespace {

Reading reading_of(std::uint64_t position, unsigned singleturn_bits, unsigned multiturn_bits, Time at) {
  Reading reading{.singleturn = position & low_mask(singleturn_bits),
                  .multiturn = position >> singleturn_bits & low_mask(multiturn_bits),
                  .singleturn_bits = singleturn_bits,
                  .multiturn_bits = multiturn_bits,
                  .singleturn_valid_bits = singleturn_bits,
                  .multiturn_valid = multiturn_bits != 0};
  reading.latched = at;
  return reading;
}

TEST(Extrapolation, NeedsTwoValidReadings) {
  Extrapolation one;
  EXPECT_FALSE(one.valid());
  one.add(reading_of(1000, 17, 16, Time(1000)));
  EXPECT_FALSE(one.valid());
  Reading invalid = reading_of(1500, 17, 16, Time(2000));
  invalid.singleturn_valid_bits = 0;
  one.add(invalid);
  EXPECT_FALSE(one.valid());
  one.add(reading_of(2000, 17, 16, Time(3000)));
  ASSERT_TRUE(one.valid());
  EXPECT_EQ(one.at(Time(3000)), 2000u);
  EXPECT_EQ(one.at(Time(5000)), 3000u);
  EXPECT_EQ(one.at(Time(1000)), 1000u);
  one.add(reading_of(2000, 18, 16, Time(4000)));
  EXPECT_FALSE(one.valid()) << "positions of two encoders were joined";
}

TEST(Extrapolation, WrapsAsTheEncoderDoes) {
  Extrapolation one;
  one.add(reading_of(0xFFF0, 16, 0, Time(0)));
  one.add(reading_of(0x0010, 16, 0, Time(1000)));
  EXPECT_EQ(one.at(Time(2000)), 0x30u);
  one.add(reading_of(0xFFF0, 16, 0, Time(2000)));
  EXPECT_EQ(one.at(Time(3000)), 0xFFD0u);
}

// The motion has constant acceleration, for which the comment of Extrapolation states the greatest error of a position.
RC_GTEST_PROP(ExtrapolationProperty, KeepsItsStatedError, ()) {
  const auto bits = *rc::gen::inRange(10u, 33u);
  const double speed = *rc::gen::inRange(-200, 201);           // speed in revolutions/s
  const double acceleration = *rc::gen::inRange(-1000, 1001);  // acceleration in revolutions/s^2
  const auto span = *rc::gen::inRange<std::int64_t>(10'000, 1'000'000);
  const auto ahead = *rc::gen::inRange<std::int64_t>(0, 1'000'000);
  const double turn = std::ldexp(1.0, static_cast<int>(bits));
  const auto counts_at = [&](std::int64_t ns) {
    const double seconds = static_cast<double>(ns) * 1e-9;
    return (1000 + speed * seconds + acceleration * seconds * seconds / 2) * turn;
  };
  Extrapolation one;
  const std::int64_t begin = 1'000'000;
  for (const std::int64_t at : {begin, begin + span}) {
    one.add(reading_of(static_cast<std::uint64_t>(std::floor(counts_at(at))), bits, 20, Time(at)));
  }
  RC_ASSERT(one.valid());
  const double wanted = counts_at(begin + span + ahead);
  const auto found = static_cast<double>(one.at(Time(begin + span + ahead)));
  const double seconds = static_cast<double>(ahead) * 1e-9;
  const double curve = std::abs(acceleration) * turn * seconds * (seconds + static_cast<double>(span) * 1e-9) / 2;
  const double noise = 1 + 2 * static_cast<double>(ahead) / static_cast<double>(span);
  RC_ASSERT(std::abs(found - wanted) <= curve + noise + 1 + std::abs(wanted) * 1e-12);
}

RC_GTEST_PROP(ExtrapolationProperty, NeverOverflows, (std::uint64_t from, std::uint64_t to, std::int64_t time)) {
  Extrapolation one;
  one.add(reading_of(from & low_mask(47), 40, 7, Time(0)));
  one.add(reading_of(to & low_mask(47), 40, 7, Time(*rc::gen::inRange<std::int64_t>(1, std::int64_t{1} << 40))));
  RC_ASSERT(one.at(Time(time / 4)) <= low_mask(47));
}

}  // namespace
}  // namespace absenc::host
