// SPDX-License-Identifier: Apache-2.0
// The version of the command and of its parts.
#pragma once

#include <string>
#include <string_view>

namespace absenc::tool {

/// Returns version and commit: "1.0.0, commit 0d3de1cd1f2a".
[[nodiscard]] std::string_view build_text();
/// Returns the name of the processor architecture that this program was compiled for: "x86-64".
[[nodiscard]] std::string_view architecture();
/// Returns what `absenc --version` prints.
[[nodiscard]] std::string version_text();

}  // namespace absenc::tool
