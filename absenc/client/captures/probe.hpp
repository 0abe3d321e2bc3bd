// SPDX-License-Identifier: Apache-2.0
// Finds values of options that a protocol's document leaves open, from captured frames.
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
  // whether all frames are right with at least one combination of option values
  bool explained = false;
  // evidence for or against each value of the options that the document leaves open
  std::vector<OptionEvidence> evidence{};
  // settings "name=value" that `decode` and `read` must be given: options for which the frames leave a single value,
  // and options with several possible values whose chosen value is not the default; may be empty
  std::vector<std::string> settled{};
};

/// Judges captured frames, given in the text form that `absenc decode` reads; "" stands for a missing frame. `requests`
/// must be as many as `replies`, or none. Throws UsageError.
[[nodiscard]] Probed probe(std::string_view protocol, std::string_view model, std::span<const std::string> settings,
                           std::span<const std::string> replies, std::span<const std::string> requests);

/// Converts the result to a JSON object, in which frames are counted from 1.
[[nodiscard]] Json to_json(const Probed& probed);

}  // namespace absenc::client
