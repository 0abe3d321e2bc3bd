// SPDX-License-Identifier: Apache-2.0
// What the table of the verb `serve` and the server have in common.
#pragma once

#include <string_view>

namespace absenc::tool {

/// The only option about MQTT that takes no value.
inline constexpr std::string_view home_assistant = "--home-assistant";

}  // namespace absenc::tool
