// SPDX-License-Identifier: Apache-2.0
// The modes in which an encoder of a unit is read, for tests of doctor.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Returns the modes of a unit as settings, such as "model=23-bit"; "" is the default mode.
[[nodiscard]] inline std::vector<std::string> modes_of(const Unit& unit) {
  std::vector<std::string> modes{""};
  for (const Model& model : unit.models) modes.push_back(fmt::format("model={}", model.name));
  for (const Option& option : unit.options) {
    // a baud rate is no mode here, because simulated hosts and encoders always have the same rate
    if (option.role == Role::rate) continue;
    for (const std::string_view choice : option.choices) modes.push_back(fmt::format("{}={}", option.name, choice));
  }
  return modes;
}

}  // namespace absenc::client
