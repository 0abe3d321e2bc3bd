// SPDX-License-Identifier: Apache-2.0
// Finds the options that the document of a protocol leaves open from captured frames.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

struct Probed {
  const Unit* unit = nullptr;
  bool explained = false;                  // at least one set of options explains all frames
  std::vector<OptionEvidence> evidence{};  // evidence for each value of each open option
  std::vector<std::string> settled{};      // "name=value": options that must be given; none: the defaults suffice
};

/// Judges captured frames. `replies` are as for `absenc decode`, "" for a missing reply; `requests` are as many in the
/// same order, "" if unknown, or none at all. Throws UsageError, also for a protocol without open options.
[[nodiscard]] Probed probe(std::string_view protocol, std::string_view model, std::span<const std::string> settings,
                           std::span<const std::string> replies, std::span<const std::string> requests);

/// Returns {"protocol","ok","evidence":[{"option","value","possible","why","frame"}],"settled"}; "frame" is the number
/// of the frame, from 1, that excludes the value.
[[nodiscard]] Json to_json(const Probed& probed);

}  // namespace absenc::client
