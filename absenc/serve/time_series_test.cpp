// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/time_series.hpp"

#include <gtest/gtest.h>

namespace absenc::serve {
namespace {

constexpr std::int64_t begin_s = 1'000'000;
constexpr std::int64_t begin_ms = 1000 * begin_s;

// The history takes each second with `take_seconds` as soon as the second has ended.
TEST(TimeSeries, LastMinuteIncludesSecondsTakenByHistory) {
  TimeSeries series;
  for (std::int64_t i = 0; i < 100; ++i) {
    series.count_reading(begin_ms + 1000 * i, static_cast<double>(i), {});
    const std::vector<Second> taken = series.take_seconds(begin_s + i + 1);
    ASSERT_EQ(taken.size(), 1u);
    EXPECT_EQ(taken.front().at_s, begin_s + i);
  }
  const std::vector<Second> minute = series.last_minute();
  ASSERT_EQ(minute.size(), 60u);
  EXPECT_EQ(minute.front().at_s, begin_s + 40);
  EXPECT_EQ(minute.back().last_place, 99);
}

TEST(TimeSeries, DoesNotTakeUnfinishedSecond) {
  TimeSeries series;
  series.count_reading(begin_ms, 1, client::Estimate{60, 0.5});
  series.count_reading(begin_ms + 10, 3, {});
  series.count_errors(begin_ms + 20, 2);
  EXPECT_TRUE(series.take_seconds(begin_s).empty());
  const std::vector<Second> taken = series.take_seconds(begin_s + 1);
  ASSERT_EQ(taken.size(), 1u);
  EXPECT_EQ(taken.front().readings, 2u);
  EXPECT_EQ(taken.front().errors, 2u);
  EXPECT_EQ(taken.front().place.mean(), 2);
  EXPECT_EQ(taken.front().speed.count, 1u);
  EXPECT_TRUE(series.take_seconds(begin_s + 2).empty());
}

TEST(TimeSeries, CountsErrorsOfLastMinute) {
  TimeSeries series;
  for (std::int64_t i = 0; i < 90; ++i) series.count_errors(begin_ms + 1000 * i, 1);
  EXPECT_EQ(series.errors_last_minute(begin_s + 89), 60u);
  EXPECT_EQ(series.errors_last_minute(begin_s + 99), 50u);
  EXPECT_EQ(series.errors_last_minute(begin_s + 200), 0u);
  EXPECT_TRUE(series.last_minute().empty());  // the list is empty, because the test counted errors only and no reading
}

TEST(TimeSeries, StoresPointsOnlyWhileTraced) {
  TimeSeries series;
  series.count_reading(begin_ms, 1, {});
  EXPECT_TRUE(series.take_points().empty());
  series.trace(true);
  for (std::int64_t i = 1; i <= 5000; ++i) series.count_reading(begin_ms + i, static_cast<double>(i), {});
  const std::vector<Point> points = series.take_points();
  ASSERT_EQ(points.size(), 4096u);
  EXPECT_EQ(points.back().place, 5000);
  EXPECT_TRUE(series.take_points().empty());
  series.count_reading(begin_ms + 5001, 1, {});
  series.trace(false);
  EXPECT_TRUE(series.take_points().empty());
}

TEST(TimeSeries, RecentPointsCoverTwentySecondsAndRestartWhenClockIsSetBack) {
  TimeSeries series;
  for (std::int64_t i = 0; i < 30'000; ++i) series.count_reading(begin_ms + i, 0, {});
  const std::vector<Point> recent = series.recent_points();
  ASSERT_EQ(recent.size(), 2001u);
  EXPECT_EQ(recent.back().at_ms - recent.front().at_ms, 20'000);
  series.count_reading(begin_ms - 5000, 0, {});
  ASSERT_EQ(series.recent_points().size(), 1u);
  series.count_reading(begin_ms - 4000, {}, {});  // the position of this reading is invalid
  EXPECT_EQ(series.recent_points().size(), 1u);
}

}  // namespace
}  // namespace absenc::serve
