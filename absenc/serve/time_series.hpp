// SPDX-License-Identifier: Apache-2.0
// The readings of one encoder by time: seconds for the history, the last minute, points for those who look.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "absenc/client/estimate.hpp"

namespace absenc::serve {

/// Position, continued past the end of a turn, and speed: in degrees and rpm, of linear encoders mm and mm/s.
struct Point {
  std::int64_t at_ms = 0;  // calendar
  double place = 0;
  std::optional<client::Estimate> speed{};
};

/// Least, greatest and mean of the values of a second.
struct Spread {
  std::uint64_t count = 0;
  double least = 0;
  double greatest = 0;
  double sum = 0;

  void add(double value);
  [[nodiscard]] double mean() const { return sum / static_cast<double>(count); }
};

struct Second {
  std::int64_t at_s = 0;  // calendar
  std::uint64_t readings = 0;
  std::uint64_t errors = 0;
  Spread place{};
  Spread speed{};                      // of the speeds that were reported, without their uncertainties
  std::optional<double> last_place{};  // a mean says nothing where a turn begins anew
};

/// Not guarded against several threads.
class TimeSeries {
 public:
  void count_errors(std::int64_t at_ms, std::uint64_t errors);
  /// A good reading. `place`: where the position held; `speed`: where it is known.
  void count_reading(std::int64_t at_ms, std::optional<double> place, const std::optional<client::Estimate>& speed);

  /// From now on points are kept until they are taken, the newest 4096 of them.
  void trace(bool on);
  [[nodiscard]] std::vector<Point> take_points();
  /// The newest of the last 20 seconds with readings, 10 ms or more apart; the oldest first.
  [[nodiscard]] std::vector<Point> recent_points() const { return {recent_.begin(), recent_.end()}; }
  /// The seconds before `now_s` that nobody has taken, the newest 120 of them.
  [[nodiscard]] std::vector<Second> take_seconds(std::int64_t now_s);
  /// The last 60 seconds with readings that are over, the oldest first: of a lost encoder those before.
  [[nodiscard]] std::vector<Second> last_minute() const { return {last_minute_.begin(), last_minute_.end()}; }
  [[nodiscard]] std::uint64_t errors_last_minute(std::int64_t now_s) const;

 private:
  void begin_second(std::int64_t at_s);
  void end_second();
  void add_point(const Point& point);

  Second second_{};  // under way; at_s is 0 before the first
  std::deque<Second> seconds_;
  std::deque<Second> last_minute_;
  bool traced_ = false;
  std::deque<Point> points_;
  std::deque<Point> recent_;
  struct Errors {
    std::int64_t at_s = 0;
    std::uint64_t count = 0;
  };
  std::array<Errors, 60> errors_{};  // by the second of the minute
};

}  // namespace absenc::serve
