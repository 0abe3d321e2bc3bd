// SPDX-License-Identifier: Apache-2.0
// The part of the table of the verb `serve` that the server uses, too.
#pragma once

#include <string_view>

namespace absenc::tool {

/// The only option about MQTT that takes no value.
inline constexpr std::string_view home_assistant = "--home-assistant";

}  // namespace absenc::tool
