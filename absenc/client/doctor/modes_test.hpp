// SPDX-License-Identifier: Apache-2.0
// For tests of what is found: the ways in which an encoder of a unit is read.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Settings of a unit that change how it is read: its usual options (""), each model, each value of each option that
/// has names or is a yes or no.
[[nodiscard]] inline std::vector<std::string> modes_of(const Unit& unit) {
  std::vector<std::string> modes{""};
  for (const Model& model : unit.models) modes.push_back(fmt::format("model={}", model.name));
  for (const Option& option : unit.options) {
    if (option.role == Role::rate) continue;  // simulated lines have none that could be wrong
    for (const std::string_view choice : option.choices) modes.push_back(fmt::format("{}={}", option.name, choice));
  }
  return modes;
}

}  // namespace absenc::client
