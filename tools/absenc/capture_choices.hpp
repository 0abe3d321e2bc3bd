// SPDX-License-Identifier: Apache-2.0
// What the options of decode, identify and crc find say of a capture.
#pragma once

#include <string_view>

#include "absenc/client/captures/run.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// From --channel, --raw-channels, --rate, --baud and --parity. Throws UsageError.
[[nodiscard]] CaptureChoices capture_choices(const Invocation& invocation, std::string_view path);

}  // namespace absenc::tool
