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
  bool explained = false;                  // some options explain all frames
  std::vector<OptionEvidence> evidence{};  // of each value of each open option
  std::vector<std::string> settled{};      // "name=value": what must be said to go on; none: the defaults will do
};

/// `replies` as for `absenc decode`, "" where none came; `requests`: as many in the same order, "" where one is not
/// known, or none. Throws UsageError, also of a protocol whose document leaves nothing open.
[[nodiscard]] Probed probe(std::string_view protocol, std::string_view model, std::span<const std::string> settings,
                           std::span<const std::string> replies, std::span<const std::string> requests);

/// {"protocol","ok","evidence":[{"option","value","possible","why","frame"}],"settled"}; "frame", from 1 on, of the
/// values that it excludes.
[[nodiscard]] Json to_json(const Probed& probed);

}  // namespace absenc::client
