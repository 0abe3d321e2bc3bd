// SPDX-License-Identifier: Apache-2.0
// Prints the bits that each field occupies in a frame, as text or JSON.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/client/text/json.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::tool {

/// Returns bit ranges as text, the most significant range first: "16-32", "7", "24-31 16-23".
[[nodiscard]] std::string ranges_text(const BitRanges& ranges);

/// The bits that each field of a good reply occupies; fields that declare no bits are left out.
class FieldPlaces {
 public:
  FieldPlaces(const Unit& unit, const Options& options, const Frame& request, const Frame& reply,
              const capture::Contents& contents);

  /// Returns the fields with their bits as "singleturn 16-32, multiturn 48-63".
  [[nodiscard]] std::string text() const;
  /// Returns {"singleturn":[{"first":16,"count":17}]}, the least significant range first.
  [[nodiscard]] Json json() const;
  /// Inserts the bits of a field as the third column of its row. The first column of each row must be the name of the
  /// field.
  void add_to(std::vector<std::vector<std::string>>& rows) const;

 private:
  std::vector<std::pair<std::string, BitRanges>> all_;
};

}  // namespace absenc::tool
