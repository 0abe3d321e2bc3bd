// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/nearest.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace absenc::client {

namespace {

char folded(char c) {
  if (c >= 'A' && c <= 'Z') return static_cast<char>(c - 'A' + 'a');
  return c == '_' ? '-' : c;
}

// Returns the edit distance of two words; two swapped neighbouring letters count as 1.
std::size_t distance(std::string_view from, std::string_view to) {
  std::vector<std::size_t> before(to.size() + 1), last(to.size() + 1), row(to.size() + 1);
  for (std::size_t j = 0; j <= to.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= from.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= to.size(); ++j) {
      const bool same = folded(from[i - 1]) == folded(to[j - 1]);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      const bool swapped =
          i > 1 && j > 1 && folded(from[i - 1]) == folded(to[j - 2]) && folded(from[i - 2]) == folded(to[j - 1]);
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = std::exchange(last, row);
  }
  return last[to.size()];
}

}  // namespace

std::string_view nearest(std::string_view written, std::span<const std::string_view> names) {
  std::string_view best;
  // a name is near if its edit distance is at most 1 plus one third of the number of written letters
  std::size_t best_distance = written.size() / 3 + 2;
  for (const std::string_view name : names) {
    const bool begins = written.size() >= 3 && name.starts_with(written);
    const std::size_t away = begins ? 1 : distance(written, name);
    if (away < best_distance) {
      best = name;
      best_distance = away;
    }
  }
  return best;
}

std::string suggestion(std::string_view written, std::span<const std::string_view> names) {
  const std::string_view near = nearest(written, names);
  if (!near.empty()) return fmt::format("; did you mean {}?", near);
  if (names.empty()) return {};
  return fmt::format("; known are: {}", fmt::join(names, ", "));
}

}  // namespace absenc::client
