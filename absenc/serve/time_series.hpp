// SPDX-License-Identifier: Apache-2.0
// Readings of one encoder over time, for the history and for plots.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "absenc/client/estimate.hpp"

namespace absenc::serve {

/// A point of a plot: a position that continues past the end of a turn, and the speed, in degrees and rpm; for linear
/// encoders in mm and mm/s.
struct Point {
  std::int64_t at_ms = 0;  // calendar time of the reading, ms since 1970
  double place = 0;
  std::optional<client::Estimate> speed{};
};

/// Number, minimum, maximum and sum of the positions or of the speeds within one second.
struct Spread {
  std::uint64_t count = 0;
  double least = 0;
  double greatest = 0;
  double sum = 0;

  void add(double value);
  [[nodiscard]] double mean() const { return sum / static_cast<double>(count); }
};

struct Second {
  std::int64_t at_s = 0;  // calendar time of the second, s since 1970
  std::uint64_t readings = 0;
  std::uint64_t errors = 0;
  Spread place{};
  Spread speed{};  // measured speeds in this second, without their uncertainties
  // Last valid position in this second; empty if there is none.
  std::optional<double> last_place{};
};

/// The readings of one encoder over time. Not thread-safe.
class TimeSeries {
 public:
  void count_errors(std::int64_t at_ms, std::uint64_t errors);
  /// Counts a good reading. `place`: its position, empty if invalid; `speed`: empty if unknown.
  void count_reading(std::int64_t at_ms, std::optional<double> place, const std::optional<client::Estimate>& speed);

  /// Starts or stops storing points for `take_points`, which returns at most the newest 4096.
  void trace(bool on);
  [[nodiscard]] std::vector<Point> take_points();
  /// Returns the points of the last 20 seconds with readings, at least 10 ms apart, oldest first.
  [[nodiscard]] std::vector<Point> recent_points() const { return {recent_.begin(), recent_.end()}; }
  /// Takes the completed seconds, at most the newest 120. A second is complete if it is before the second `now_s`.
  [[nodiscard]] std::vector<Second> take_seconds(std::int64_t now_s);
  /// Returns the last completed seconds with readings, at most 60, oldest first.
  [[nodiscard]] std::vector<Second> last_minute() const { return {last_minute_.begin(), last_minute_.end()}; }
  [[nodiscard]] std::uint64_t errors_last_minute(std::int64_t now_s) const;

 private:
  void begin_second(std::int64_t at_s);
  void end_second();
  void add_point(const Point& point);

  // the second whose readings and errors are being counted; its `at_s` is 0 if no second has begun since the last one
  // ended
  Second second_{};
  std::deque<Second> seconds_;
  std::deque<Second> last_minute_;
  bool traced_ = false;
  std::deque<Point> points_;
  std::deque<Point> recent_;
  struct Errors {
    std::int64_t at_s = 0;
    std::uint64_t count = 0;
  };
  // numbers of errors in the last 60 seconds; the index is the second within the minute
  std::array<Errors, 60> errors_{};
};

}  // namespace absenc::serve
