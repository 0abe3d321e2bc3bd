// SPDX-License-Identifier: Apache-2.0
// Reads the options that describe a capture, for the verbs decode and identify.
#pragma once

#include <string_view>

#include "absenc/client/captures/run.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

/// Returns the path of a capture with the command-line options that describe it. Throws UsageError.
[[nodiscard]] CaptureChoices capture_choices(const Invocation& invocation, std::string_view path);

}  // namespace absenc::tool
