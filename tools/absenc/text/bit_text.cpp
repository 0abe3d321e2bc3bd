// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text/bit_text.hpp"
#include "absenc/client/text/unit_text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace absenc::tool {

std::string ranges_text(const BitRanges& ranges) {
  std::string text;
  for (std::size_t i = ranges.size(); i > 0; --i) {
    const BitRange& range = ranges[i - 1];
    if (!text.empty()) text += ' ';
    text += fmt::format("{}", range.first);
    if (range.count > 1) text += fmt::format("-{}", range.first + range.count - 1);
  }
  return text;
}

FieldPlaces::FieldPlaces(const Unit& unit, const Options& options, const Frame& request, const Frame& reply,
                         const capture::Contents& contents) {
  if (unit.bits == nullptr || reply.empty()) return;
  for (const FieldValue& field : contents.fields) {
    const BitRanges ranges = unit.bits(options, request, reply, *field.info);
    if (!ranges.empty()) all_.emplace_back(field.info->name, ranges);
  }
}

std::string FieldPlaces::text() const {
  std::string text;
  for (const auto& [name, ranges] : all_) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, ranges_text(ranges));
  }
  return text;
}

Json FieldPlaces::json() const {
  Json json = Json::object();
  for (const auto& [name, ranges] : all_) {
    json.set(name, Json::list(ranges.view(), [](const BitRange& range) {
               Json part = Json::object().set("first", range.first).set("count", range.count);
               return range.inverted ? part.set("inverted", true) : part;
             }));
  }
  return json;
}

void FieldPlaces::add_to(std::vector<std::vector<std::string>>& rows) const {
  for (std::vector<std::string>& row : rows) {
    const auto place = std::find_if(all_.begin(), all_.end(), [&](const auto& one) { return one.first == row[0]; });
    row.insert(row.begin() + 2, place == all_.end() ? "" : "bits " + ranges_text(place->second));
  }
}

}  // namespace absenc::tool
