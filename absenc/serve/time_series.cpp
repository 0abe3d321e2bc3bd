// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/time_series.hpp"

#include <algorithm>
#include <utility>

namespace absenc::serve {

namespace {

constexpr std::size_t most_points = 4096;
constexpr std::int64_t recent_ms = 20'000;
constexpr std::int64_t between_recent_ms = 10;
constexpr std::size_t most_seconds = 120;  // greatest number of seconds that wait to be written into the history
constexpr std::size_t minute_s = 60;

}  // namespace

void Spread::add(double value) {
  least = count == 0 ? value : std::min(least, value);
  greatest = count == 0 ? value : std::max(greatest, value);
  sum += value;
  ++count;
}

void TimeSeries::count_errors(std::int64_t at_ms, std::uint64_t errors) {
  const std::int64_t at_s = at_ms / 1000;
  begin_second(at_s);
  second_.errors += errors;
  Errors& slot = errors_[static_cast<std::size_t>(at_s % static_cast<std::int64_t>(minute_s))];
  if (slot.at_s != at_s) slot = {at_s, 0};
  slot.count += errors;
}

void TimeSeries::count_reading(std::int64_t at_ms, std::optional<double> place,
                               const std::optional<client::Estimate>& speed) {
  begin_second(at_ms / 1000);
  ++second_.readings;
  if (!place) return;
  second_.place.add(*place);
  second_.last_place = place;
  if (speed) second_.speed.add(speed->value);
  add_point({at_ms, *place, speed});
}

void TimeSeries::begin_second(std::int64_t at_s) {
  if (at_s == second_.at_s) return;
  end_second();
  second_.at_s = at_s;
}

void TimeSeries::end_second() {
  if (second_.at_s == 0) return;
  seconds_.push_back(second_);
  if (seconds_.size() > most_seconds) seconds_.pop_front();
  if (second_.readings != 0) last_minute_.push_back(second_);
  if (last_minute_.size() > minute_s) last_minute_.pop_front();
  second_ = {};
}

void TimeSeries::add_point(const Point& point) {
  const std::int64_t at_ms = point.at_ms;
  // After the calendar clock was set back, a new point has an earlier time than the point before it.
  const bool is_next =
      recent_.empty() || at_ms - recent_.back().at_ms >= between_recent_ms || at_ms < recent_.back().at_ms;
  if (is_next) {
    recent_.push_back(point);
    while (recent_.front().at_ms < at_ms - recent_ms || recent_.front().at_ms > at_ms) recent_.pop_front();
  }
  if (!traced_) return;
  points_.push_back(point);
  if (points_.size() > most_points) points_.pop_front();
}

void TimeSeries::trace(bool on) {
  traced_ = on;
  if (!on) points_.clear();
}

std::vector<Point> TimeSeries::take_points() {
  std::vector<Point> taken(points_.begin(), points_.end());
  points_.clear();
  return taken;
}

std::vector<Second> TimeSeries::take_seconds(std::int64_t now_s) {
  if (second_.at_s < now_s) end_second();
  std::vector<Second> taken(seconds_.begin(), seconds_.end());
  seconds_.clear();
  return taken;
}

std::uint64_t TimeSeries::errors_last_minute(std::int64_t now_s) const {
  std::uint64_t sum = 0;
  for (const Errors& one : errors_) {
    if (now_s - one.at_s < static_cast<std::int64_t>(minute_s)) sum += one.count;
  }
  return sum;
}

}  // namespace absenc::serve
