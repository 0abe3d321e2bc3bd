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
  bool explained = false;                  // whether at least one set of options explains all frames
  std::vector<OptionEvidence> evidence{};  // evidence for or against values of the open options
  std::vector<std::string> settled{};      // options that later commands need, as "name=value"; may be empty
};

/// Judges captured frames, given in the text form that `absenc decode` reads; "" stands for a missing frame. `requests`
/// must be as many as `replies`, or none. Throws UsageError.
[[nodiscard]] Probed probe(std::string_view protocol, std::string_view model, std::span<const std::string> settings,
                           std::span<const std::string> replies, std::span<const std::string> requests);

/// Converts the result to a JSON object, in which frames are counted from 1.
[[nodiscard]] Json to_json(const Probed& probed);

}  // namespace absenc::client
