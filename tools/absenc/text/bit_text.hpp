// SPDX-License-Identifier: Apache-2.0
// Where in a frame its fields stand, for people and for programs.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/client/text/json.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::tool {

/// "16-32", "7", "24-31 16-23": from the most significant on.
[[nodiscard]] std::string ranges_text(const BitRanges& ranges);

/// The fields of a good reply of which its unit says where they stand, in order.
class FieldPlaces {
 public:
  FieldPlaces(const Unit& unit, const Options& options, const Frame& request, const Frame& reply,
              const capture::Contents& contents);

  /// "singleturn 16-32, multiturn 48-63"; "" when nothing is told.
  [[nodiscard]] std::string text() const;
  /// {"singleturn":[{"first":16,"count":17}]}, the least significant part first.
  [[nodiscard]] Json json() const;
  /// Puts a column behind the value of each field.
  void add_to(std::vector<std::vector<std::string>>& rows) const;

 private:
  std::vector<std::pair<std::string, BitRanges>> all_;
};

}  // namespace absenc::tool
