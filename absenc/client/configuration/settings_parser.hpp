// SPDX-License-Identifier: Apache-2.0
// Parses absenc.toml.
#pragma once

#include <string>
#include <string_view>

#include "absenc/client/port/settings_file.hpp"

namespace absenc::client {

/// Parses the text of absenc.toml; `path` is its name in errors. Throws UsageError.
[[nodiscard]] SettingsFile parse_settings_file(std::string_view text, const std::string& path);

}  // namespace absenc::client
