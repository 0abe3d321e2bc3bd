// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/short_names.hpp"

#include <algorithm>
#include <set>
#include <string_view>

namespace absenc::tool {

namespace {

using Names = std::vector<std::string>;

constexpr std::string_view gap = "..";

std::string cut(const std::string& name, std::size_t width, std::size_t head) {
  if (name.size() <= width) return name;
  return name.substr(0, head) + std::string(gap) + name.substr(name.size() - (width - head - gap.size()));
}

Names cut_all(std::span<const std::string> names, std::size_t width, std::size_t head) {
  Names cuts;
  for (const std::string& name : names) cuts.push_back(cut(name, width, head));
  return cuts;
}

std::size_t count_different(std::span<const std::string> names) {
  return std::set<std::string_view>(names.begin(), names.end()).size();
}

// Cuts the names at one common place to `width` bytes. Returns nothing if no such place keeps them different.
Names cut_in_the_middle(std::span<const std::string> names, std::size_t width) {
  const std::size_t different = count_different(names);
  const std::size_t most = width - gap.size();
  for (std::size_t step = 0; step <= most + 1; ++step) {
    const std::size_t head = step % 2 == 0 ? most / 2 + step / 2 : most / 2 - std::min(most / 2, step / 2 + 1);
    Names cuts = cut_all(names, width, std::min(head, most));
    if (count_different(cuts) == different) return cuts;
  }
  return {};
}

// Lengths of the beginning and of the end that all names have in common.
struct Common {
  std::size_t front;
  std::size_t back;
};

Common common_parts(std::span<const std::string> names) {
  const std::string& first = names.front();
  std::size_t shortest = first.size();
  Common common{first.size(), first.size()};
  for (const std::string& name : names) {
    const auto front = std::mismatch(first.begin(), first.end(), name.begin(), name.end()).first - first.begin();
    const auto back = std::mismatch(first.rbegin(), first.rend(), name.rbegin(), name.rend()).first - first.rbegin();
    common.front = std::min(common.front, static_cast<std::size_t>(front));
    common.back = std::min(common.back, static_cast<std::size_t>(back));
    shortest = std::min(shortest, name.size());
  }
  common.back = std::min(common.back, shortest - common.front);
  return common;
}

// Returns the names with ".." in place of the beginning and the end that all of them have in common, if there are any.
Names middles(std::span<const std::string> names) {
  const auto [front, back] = common_parts(names);
  Names cuts;
  for (const std::string& name : names) {
    cuts.push_back((front > 0 ? std::string(gap) : "") + name.substr(front, name.size() - front - back) +
                   (back > 0 ? std::string(gap) : ""));
  }
  return cuts;
}

// Returns each name after its number, cut to `width` bytes together: "3 tfo..=7". Equal names have the same number.
Names numbered(std::span<const std::string> names, std::size_t width) {
  Names cuts;
  for (const std::string& name : names) {
    const auto first = std::find(names.begin(), names.end(), name) - names.begin();
    const std::string number = std::to_string(first + 1) + ' ';
    const std::size_t room = width - std::min(width - gap.size(), number.size());
    cuts.push_back(number + cut(name, room, (room - gap.size()) / 2));
  }
  return cuts;
}

}  // namespace

std::vector<std::string> short_names(std::span<const std::string> names, std::size_t width) {
  if (names.empty()) return {};
  if (Names cuts = cut_in_the_middle(names, width); !cuts.empty()) return cuts;
  if (Names cuts = cut_in_the_middle(middles(names), width); !cuts.empty()) return cuts;
  return numbered(names, width);
}

}  // namespace absenc::tool
