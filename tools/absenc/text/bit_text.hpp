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

/// The bits of a good reply that each of its fields occupies, as far as the unit declares them, in the order of the
/// fields.
class FieldPlaces {
 public:
  FieldPlaces(const Unit& unit, const Options& options, const Frame& request, const Frame& reply,
              const capture::Contents& contents);

  /// Returns the fields with their bits as "singleturn 16-32, multiturn 48-63"; "" if the unit declares no bits.
  [[nodiscard]] std::string text() const;
  /// Returns the fields with their bits as {"singleturn":[{"first":16,"count":17}]}, the least significant range of a
  /// field first.
  [[nodiscard]] Json json() const;
  /// Adds a column with the bits of each field to `rows`, after the column of the values.
  void add_to(std::vector<std::vector<std::string>>& rows) const;

 private:
  std::vector<std::pair<std::string, BitRanges>> all_;
};

}  // namespace absenc::tool
