// SPDX-License-Identifier: Apache-2.0
// Finds bursts of failed readings and their period.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/doctor/judges.hpp"
#include "absenc/client/doctor/words.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

namespace {

/// A series of consecutive failed readings, with its times and its length.
struct Burst {
  Time begin{};
  Time end{};
  std::size_t count = 0;
};

// Returns the series of consecutive failures that are too long to be a coincidence of independent failures.
std::vector<Burst> bursts_of(const std::vector<Attempted>& readings, std::size_t failed) {
  // a series of failures is a burst if independent failures would form one among all readings with at most this
  // probability
  constexpr double chance = 1e-3;
  const auto all = static_cast<double>(readings.size());
  const double longest = std::log(chance / all) / std::log(static_cast<double>(failed) / all);
  const auto least = static_cast<std::size_t>(std::max(3.0, std::ceil(longest)));
  std::vector<Burst> bursts;
  Burst burst;
  for (const Attempted& one : readings) {
    if (one.error != Error::none) {
      if (burst.count++ == 0) burst.begin = one.began;
      continue;
    }
    burst.end = one.began;
    if (burst.count >= least) bursts.push_back(burst);
    burst = {};
  }
  return bursts;  // the last series of failures is left out, because it may continue after the last reading
}

// Returns the usual length and distance of bursts in words, as " of about 300 ms, one every 1 s".
std::string rhythm(const std::vector<Burst>& bursts) {
  std::vector<Time> lengths;
  std::vector<Time> periods;
  for (std::size_t i = 0; i < bursts.size(); ++i) {
    lengths.push_back(bursts[i].end - bursts[i].begin);
    if (i > 0) periods.push_back(bursts[i].begin - bursts[i - 1].begin);
  }
  std::ranges::sort(lengths);
  std::ranges::sort(periods);
  const std::string length = fmt::format(" of about {}", to_text(lengths[lengths.size() / 2]));
  const Time period = periods[periods.size() / 2];
  const bool even = periods.back() - periods.front() < period / 5;
  return length + (even ? fmt::format(", one every {}", to_text(period)) : ", at uneven distances");
}

}  // namespace

std::optional<Finding> coming_and_going(const Case& one) {
  constexpr std::size_t enough = 3;
  const std::vector<Attempted>& readings = one.seen.readings;
  const std::size_t failed = readings.size() - one.good;
  if (failed == 0) return std::nullopt;
  const std::vector<Burst> bursts = bursts_of(readings, failed);
  std::size_t in_bursts = 0;
  for (const Burst& burst : bursts) in_bursts += burst.count;
  if (bursts.size() < enough || in_bursts * 10 < failed * 7) return std::nullopt;
  return finding(FindingKind::comes_and_goes, {fmt::format("{}", failed), fmt::format("{}", readings.size()),
                                               fmt::format("{}", bursts.size()), rhythm(bursts)});
}

}  // namespace absenc::client
