// SPDX-License-Identifier: Apache-2.0
// Error codes of Windows as values of errno, and as failures with the text of Windows.
#pragma once

#include <windows.h>

#include <string>

#include "absenc/os/error.hpp"

namespace absenc::os {

/// Returns the value of errno that means the same as `error`, a code of GetLastError or WSAGetLastError; EIO if none.
[[nodiscard]] int errno_of(DWORD error);

/// Returns the text of Windows for `error`, without a full stop, as "Access is denied (error 5)".
[[nodiscard]] std::string text_of_error(DWORD error);

/// Returns a Failure "<what> failed: <text of error>".
[[nodiscard]] Failure windows_failure(const std::string& what, DWORD error);

}  // namespace absenc::os
