// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/first_reading.hpp"

#include <gtest/gtest.h>

namespace absenc::host {
namespace {

using namespace std::chrono_literals;

constexpr Reading reading_at(std::uint64_t singleturn, std::uint64_t multiturn, Time latched) {
  return {.singleturn = singleturn,
          .multiturn = multiturn,
          .singleturn_bits = 17,
          .multiturn_bits = 16,
          .singleturn_valid_bits = 17,
          .multiturn_valid = true,
          .latched = latched};
}

constexpr Reading of_bits(unsigned bits, std::uint64_t singleturn, Time latched) {
  return {.singleturn = singleturn, .singleturn_bits = bits, .singleturn_valid_bits = bits, .latched = latched};
}

constexpr bool agree(FirstReading first, const Reading& one, const Reading& other) {
  return !first.confirms(one) && first.confirms(other);
}

TEST(FirstReading, AllowsNoMoreThanTheFastestShaft) {
  // 6000 rpm are 100 turns a second: 13 107 counts of 17 bits in 1 ms.
  const auto confirmed = [](std::uint64_t singleturn, std::uint64_t multiturn) {
    return agree(FirstReading(6000), reading_at(0, 0, {}), reading_at(singleturn, multiturn, 1ms));
  };
  EXPECT_TRUE(confirmed(13'107, 0));
  EXPECT_FALSE(confirmed(13'120, 0));
  // A movement of 13 107 counts backwards passes zero of the turn and of the turn counter.
  EXPECT_TRUE(confirmed(131'072 - 13'107, 65'535));
  EXPECT_FALSE(confirmed(0, 1));
  EXPECT_FALSE(confirmed(0, 32'768));
}

TEST(FirstReading, ComparesPositionsWithTheirTurnsIfTheseAreValid) {
  const auto place = FirstReading::place_of(reading_at(5, 3, {}));
  EXPECT_TRUE(place.has_turns());
  EXPECT_EQ(place.distance(FirstReading::place_of(reading_at(131'071, 2, {}))), 6u);
  EXPECT_EQ(place.distance(FirstReading::place_of(reading_at(5, 65'535, {}))), 4u << 17) << "past the end of the turns";
  Reading invalid = reading_at(131'071, 2, {});
  invalid.multiturn_valid = false;
  const auto within = FirstReading::place_of(invalid);
  EXPECT_FALSE(within.has_turns());
  EXPECT_FALSE(within.is_like(place));
  EXPECT_EQ(within.distance(FirstReading::place_of(of_bits(17, 5, {}))), 6u);
  invalid.ready = false;
  EXPECT_FALSE(FirstReading::place_of(invalid).is_like(FirstReading::place_of(invalid))) << "it has no position";
}

TEST(FirstReading, HasADefaultLimit) {
  const auto confirmed = [](std::uint64_t singleturn, Time later) {
    return agree(FirstReading(0), of_bits(13, 0, {}), of_bits(13, singleturn, later));
  };
  EXPECT_TRUE(confirmed(136, 100us)) << "a sixtieth of a turn";
  EXPECT_FALSE(confirmed(150, 100us));
  EXPECT_FALSE(confirmed(1024, 100us));
}

TEST(FirstReading, RefusesHalfATurn) {
  for (const Time later : {Time(10ms), Time(1s), Time(24h), never}) {
    EXPECT_FALSE(agree(FirstReading(10'000), of_bits(13, 7, {}), of_bits(13, 7 + 4096, later)));
    EXPECT_FALSE(agree(FirstReading(10'000), of_bits(13, 7, {}), of_bits(13, 7 + 3841, later)));
    EXPECT_TRUE(agree(FirstReading(10'000), of_bits(13, 7, {}), of_bits(13, 7 + 3840, later)));
  }
}

// 12 000 rpm, twice the limit, are 200 turns a second: 0.2 of a turn in 1 ms.
TEST(FirstReading, ConfirmsFasterShaftAtThirdPosition) {
  FirstReading first(6000);
  EXPECT_FALSE(first.confirms(of_bits(13, 0, 0ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 1638, 1ms)));
  EXPECT_TRUE(first.confirms(of_bits(13, 3277, 2ms)));
  EXPECT_TRUE(first.confirms(of_bits(13, 4915, 3ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 3415, 4ms))) << "damaged";
  EXPECT_FALSE(first.confirms(of_bits(13, 0, 5ms)));
}

TEST(FirstReading, RefusesMuchFasterShaft) {
  // `step` is in counts of 13 bits. At 6000 rpm 819 of them are allowed in 1 ms, and at the third position four times
  // as many.
  for (const std::uint64_t step : {1638u, 3276u, 3500u}) {
    FirstReading first(6000);
    EXPECT_FALSE(first.confirms(of_bits(15, 0, 0ms)));
    EXPECT_FALSE(first.confirms(of_bits(15, 4 * step, 1ms)));
    EXPECT_EQ(first.confirms(of_bits(15, 8 * step, 2ms)), step <= 3276);
  }
}

// At 6000 rpm 819 counts of 13 bits are allowed in 1 ms. What lies before the first position is no step.
TEST(FirstReading, NeedsAStepBeforeAFasterOne) {
  FirstReading first(6000);
  EXPECT_FALSE(first.confirms(of_bits(13, 1500, 0ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 3000, 1ms)));
}

// A shaft that kept to the limit until now does not move faster suddenly.
TEST(FirstReading, RefusesFasterStepAfterAnAllowedOne) {
  FirstReading first(6000);
  EXPECT_FALSE(first.confirms(of_bits(13, 0, 0ms)));
  EXPECT_TRUE(first.confirms(of_bits(13, 800, 1ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 800 + 900, 2ms)));
}

TEST(FirstReading, RefusesTwoDamagedPositions) {
  FirstReading first(6000);
  EXPECT_FALSE(first.confirms(of_bits(13, 100, 0ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 100 + 2048, 1ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 100, 2ms)));
  EXPECT_TRUE(first.confirms(of_bits(13, 100, 3ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 100 + 1024, 4ms)));
  EXPECT_FALSE(first.confirms(of_bits(13, 100 + 4096, 5ms)));
}

TEST(FirstReading, ComparesTheTurnsWhereBothHaveThem) {
  const Reading with = reading_at(5, 5, {});
  Reading without = with;
  without.multiturn_valid = false;
  EXPECT_FALSE(agree(FirstReading(6000), with, without));
  EXPECT_FALSE(agree(FirstReading(6000), without, with)) << "nothing is known of the turns before";
  EXPECT_TRUE(agree(FirstReading(6000), without, without));
}

TEST(FirstReading, TakesPositionsOf64Bits) {
  EXPECT_TRUE(agree(FirstReading(1), of_bits(64, ~std::uint64_t{0}, {}), of_bits(64, 3, {})));
  EXPECT_FALSE(agree(FirstReading(1), of_bits(64, ~std::uint64_t{0}, {}), of_bits(64, 4, {})));
  EXPECT_FALSE(agree(FirstReading(1), of_bits(64, 0, {}), of_bits(64, std::uint64_t{1} << 63, never)));
  EXPECT_TRUE(agree(FirstReading(10'000), of_bits(64, 0, {}), of_bits(64, std::uint64_t{15} << 59, 3s)));
}

TEST(FirstReading, UsesSpeedOfCarriage) {
  // A carriage at 1 m/s moves 1000 counts of 1 um in a millisecond.
  const FirstReading first(Reach::of({.mm_s = 1000}, {.singleturn_bits = 26, .multiturn_bits = 0, .unit_um = 1}));
  EXPECT_TRUE(agree(first, of_bits(26, 0, {}), of_bits(26, 1004, 1ms)));
  EXPECT_FALSE(agree(first, of_bits(26, 0, {}), of_bits(26, 1006, 1ms)));
}

static_assert(agree(FirstReading(6000), of_bits(17, 1, {}), of_bits(17, 2, {})));

TEST(FirstReading, WaitsUntilTheEncoderIsReady) {
  FirstReading first(6000);
  Reading starting = reading_at(5, 5, {});
  starting.ready = false;
  EXPECT_FALSE(first.confirms(starting));
  EXPECT_FALSE(first.confirms(reading_at(5, 5, {})));
  EXPECT_FALSE(first.confirms(starting));
  EXPECT_FALSE(first.confirms(reading_at(5, 5, {})));
  EXPECT_TRUE(first.confirms(reading_at(5, 5, {})));
}

}  // namespace
}  // namespace absenc::host
