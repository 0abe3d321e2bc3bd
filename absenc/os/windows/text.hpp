// SPDX-License-Identifier: Apache-2.0
// Texts of Windows, UTF-16, as texts of absenc, UTF-8.
#pragma once

#include <string>
#include <string_view>

namespace absenc::os {

/// Returns `text` in UTF-8; what is no valid UTF-16 becomes U+FFFD.
[[nodiscard]] std::string utf8(std::wstring_view text);
/// Returns `text` in UTF-16; what is no valid UTF-8 becomes U+FFFD.
[[nodiscard]] std::wstring utf16(std::string_view text);

}  // namespace absenc::os
