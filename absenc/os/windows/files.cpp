// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/windows/files.hpp"

#include <fcntl.h>
#include <io.h>

#include <algorithm>
#include <atomic>
#include <cerrno>

#include "absenc/os/error.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/text.hpp"
#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {

namespace {

OVERLAPPED place(std::uint64_t at) {
  OVERLAPPED where{};
  where.Offset = static_cast<DWORD>(at);
  where.OffsetHigh = static_cast<DWORD>(at >> 32);
  return where;
}

constexpr std::size_t most = 1 << 30;  // Windows counts in 32 bits

}  // namespace

Descriptor open_file(const std::string& path, DWORD share, DWORD creation, DWORD flags) {
  // With the right to delete the file, programs that share it without that right could not open it meanwhile.
  const DWORD access = GENERIC_READ | GENERIC_WRITE | ((flags & FILE_FLAG_DELETE_ON_CLOSE) != 0 ? DELETE : 0);
  Handle file(::CreateFileW(utf16(path).c_str(), access, share, nullptr, creation, flags, nullptr));
  if (!file) {
    errno = errno_of(::GetLastError());
    return {};
  }
  Descriptor descriptor(::_open_osfhandle(reinterpret_cast<std::intptr_t>(file.get()), _O_RDWR | _O_BINARY));
  if (descriptor) static_cast<void>(file.release());
  return descriptor;
}

HANDLE handle_of_file(int descriptor) { return reinterpret_cast<HANDLE>(::_get_osfhandle(descriptor)); }

int write_at(int descriptor, std::uint64_t at, std::string_view bytes) {
  while (!bytes.empty()) {
    OVERLAPPED where = place(at);
    DWORD size = 0;
    if (::WriteFile(handle_of_file(descriptor), bytes.data(), static_cast<DWORD>(std::min(bytes.size(), most)), &size,
                    &where) == 0) {
      return errno_of(::GetLastError());
    }
    if (size == 0) return ENOSPC;
    bytes.remove_prefix(size);
    at += size;
  }
  return 0;
}

std::string read_at(int descriptor, std::uint64_t at, std::size_t size, const std::string& path) {
  std::string bytes(size, '\0');
  std::size_t done = 0;
  while (done < size) {
    OVERLAPPED where = place(at + done);
    DWORD got = 0;
    if (::ReadFile(handle_of_file(descriptor), bytes.data() + done, static_cast<DWORD>(std::min(size - done, most)),
                   &got, &where) == 0) {
      if (::GetLastError() == ERROR_HANDLE_EOF) break;
      throw windows_failure("reading " + path, ::GetLastError());
    }
    if (got == 0) break;
    done += got;
  }
  bytes.resize(done);
  return bytes;
}

int set_size(int descriptor, std::uint64_t size) {
  FILE_END_OF_FILE_INFO end{};
  end.EndOfFile.QuadPart = static_cast<LONGLONG>(size);
  const BOOL done = ::SetFileInformationByHandle(handle_of_file(descriptor), FileEndOfFileInfo, &end, sizeof end);
  return done != 0 ? 0 : errno_of(::GetLastError());
}

int rename_file(const std::string& from, const std::string& to, bool replaces) {
  const DWORD flags = replaces ? MOVEFILE_REPLACE_EXISTING : 0;
  return ::MoveFileExW(utf16(from).c_str(), utf16(to).c_str(), flags) != 0 ? 0 : errno_of(::GetLastError());
}

std::string temporary_path(const std::string& path) {
  static std::atomic<unsigned> count{0};
  return path + "." + std::to_string(::GetCurrentProcessId()) + "-" + std::to_string(++count);
}

}  // namespace absenc::os
