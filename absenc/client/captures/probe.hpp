// SPDX-License-Identifier: Apache-2.0
// From captured frames, finds the values of options that the document of a protocol leaves open.
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
  bool explained = false;                  // whether at least one set of options explains all frames
  std::vector<OptionEvidence> evidence{};  // evidence for each value of each open option
  std::vector<std::string> settled{};      // options that later commands need, as "name=value"; may be empty
};

/// Judges captured frames. `replies` have the text form that `absenc decode` reads, "" for a missing reply. `requests`
/// are as many, in the same order, "" for an unknown request; or the list is empty. Throws UsageError, also for a
/// protocol without open options.
[[nodiscard]] Probed probe(std::string_view protocol, std::string_view model, std::span<const std::string> settings,
                           std::span<const std::string> replies, std::span<const std::string> requests);

/// Converts the result to {"protocol","ok","evidence":[{"option","value","possible","why","frame"}],"settled"}; "frame"
/// is the number, from 1, of the frame that excludes the value.
[[nodiscard]] Json to_json(const Probed& probed);

}  // namespace absenc::client
