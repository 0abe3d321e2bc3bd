// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/captures/position_trace.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

namespace absenc::client {

void PositionTrace::halve() {
  for (std::size_t i = 0; i < columns / 2; ++i) {
    const Extent& a = columns_[2 * i];
    const Extent& b = columns_[2 * i + 1];
    columns_[i] = {std::min(a.least, b.least), std::max(a.most, b.most)};
  }
  std::fill(columns_.begin() + columns / 2, columns_.end(), Extent{});
  ++shift_;
}

double PositionTrace::value(std::uint64_t counts) const {
  if (unit_um_ > 0) return micrometres(counts, unit_um_) / 1000;
  if (!turns_) return degrees(counts, bits_);
  const double all =
      signed_ ? static_cast<double>(static_cast<std::int64_t>(counts - offset())) : static_cast<double>(counts);
  return std::ldexp(all, -static_cast<int>(bits_));
}

std::string_view PositionTrace::unit() const { return unit_um_ > 0 ? "mm" : turns_ ? "turns" : "deg"; }

std::string PositionTrace::plot() const {
  if (count_ == 0) return {};
  constexpr int rows = 10;
  std::uint64_t least = UINT64_MAX;
  std::uint64_t most = 0;
  for (const Extent& column : columns_) {
    least = std::min(least, column.least);
    most = std::max(most, column.most);
  }
  const double bottom = value(least);
  const double height = std::max(value(most) - bottom, 1e-9);
  const auto row_of = [&](std::uint64_t counts) {
    return std::min(rows - 1, static_cast<int>((value(counts) - bottom) / height * rows));
  };
  const int decimals = std::clamp(3 - static_cast<int>(std::floor(std::log10(height))), 0, 6);
  std::vector<std::string> lines(rows, std::string(columns, ' '));
  for (std::size_t i = 0; i < columns; ++i) {
    if (columns_[i].empty()) continue;
    const int high = row_of(columns_[i].most);
    for (int row = row_of(columns_[i].least); row <= high; ++row) lines[static_cast<std::size_t>(row)][i] = '*';
  }
  std::string text;
  for (int row = rows; row-- > 0;) {
    const bool labelled = row == rows - 1 || row == 0;
    const double label = row == 0 ? bottom : bottom + height;
    const std::string left = labelled ? fmt::format("{:.{}f} {}", label, decimals, unit()) : "";
    std::string line = fmt::format("{:>16} |{}", left, lines[static_cast<std::size_t>(row)]);
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + '\n';
  }
  return text;
}

}  // namespace absenc::client
