// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/windows/errors.hpp"

#include <winsock2.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "absenc/os/windows/text.hpp"

namespace absenc::os {

namespace {

struct SameError {
  DWORD error;
  int number;
};

constexpr std::array<SameError, 38> same_errors{{
    {ERROR_FILE_NOT_FOUND, ENOENT},
    {ERROR_PATH_NOT_FOUND, ENOENT},
    {ERROR_INVALID_NAME, ENOENT},
    {ERROR_BAD_NETPATH, ENOENT},
    {ERROR_DIRECTORY, ENOTDIR},
    {ERROR_ACCESS_DENIED, EACCES},
    {ERROR_WRITE_PROTECT, EROFS},
    {ERROR_SHARING_VIOLATION, EBUSY},
    {ERROR_LOCK_VIOLATION, EBUSY},
    {ERROR_INVALID_HANDLE, EBADF},
    {ERROR_INVALID_FUNCTION, ENOTTY},
    {ERROR_INVALID_PARAMETER, EINVAL},
    {ERROR_FILE_EXISTS, EEXIST},
    {ERROR_ALREADY_EXISTS, EEXIST},
    {ERROR_NOT_ENOUGH_MEMORY, ENOMEM},
    {ERROR_HANDLE_DISK_FULL, ENOSPC},
    {ERROR_DISK_FULL, ENOSPC},
    {ERROR_FILE_TOO_LARGE, EFBIG},
    {ERROR_BROKEN_PIPE, EPIPE},
    {ERROR_NO_DATA, EPIPE},
    {ERROR_PIPE_NOT_CONNECTED, EPIPE},
    {ERROR_HANDLE_EOF, EPIPE},
    {ERROR_IO_PENDING, EAGAIN},
    {ERROR_IO_INCOMPLETE, EAGAIN},
    {ERROR_DEVICE_NOT_CONNECTED, ENODEV},
    {ERROR_DEVICE_REMOVED, ENODEV},
    {433, ENODEV},                      // ERROR_NO_SUCH_DEVICE, which the headers of mingw lack
    {ERROR_BAD_COMMAND, ENODEV},        // a USB adapter that is gone
    {ERROR_GEN_FAILURE, ENODEV},        // the same, of other drivers
    {ERROR_OPERATION_ABORTED, ENODEV},  // the driver has ended a read because the adapter is gone
    {ERROR_NETNAME_DELETED, ECONNRESET},
    {WSAECONNREFUSED, ECONNREFUSED},
    {WSAECONNRESET, ECONNRESET},
    {WSAECONNABORTED, ECONNRESET},
    {WSAETIMEDOUT, ETIMEDOUT},
    {WSAEHOSTUNREACH, EHOSTUNREACH},
    {WSAENETUNREACH, ENETUNREACH},
    {WSAEADDRINUSE, EADDRINUSE},
}};

}  // namespace

int errno_of(DWORD error) {
  const auto* const found = std::find_if(same_errors.begin(), same_errors.end(),
                                         [error](const SameError& one) { return one.error == error; });
  return found == same_errors.end() ? EIO : found->number;
}

std::string text_of_error(DWORD error) {
  std::array<wchar_t, 512> text{};
  const DWORD size = ::FormatMessageW(FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS, nullptr, error, 0,
                                      text.data(), static_cast<DWORD>(text.size()), nullptr);
  std::string words = utf8({text.data(), size});
  words.erase(words.find_last_not_of(" .\r\n") + 1);
  return (words.empty() ? "unknown" : words) + " (error " + std::to_string(error) + ")";
}

Failure windows_failure(const std::string& what, DWORD error) {
  return {Failure::Kind::system, what + " failed: " + text_of_error(error)};
}

}  // namespace absenc::os
