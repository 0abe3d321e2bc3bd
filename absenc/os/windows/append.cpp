// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/append.hpp"

#include <windows.h>

#include <cerrno>
#include <filesystem>

#include "absenc/os/file_name.hpp"
#include "absenc/os/windows/files.hpp"

namespace absenc::os {

int append_line(const std::string& path, std::string_view line) {
  std::error_code ignored;  // no error is reported here: if the folder is missing, opening the file fails
  std::filesystem::create_directories(path_of(path).parent_path(), ignored);
  const Descriptor file = open_file(path, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, OPEN_ALWAYS);
  if (!file) return errno;
  // Other programs append, too: each waits until the other has written. The locked byte is behind any line.
  OVERLAPPED behind{};
  behind.OffsetHigh = 0x7FFF'FFFF;
  if (::LockFileEx(handle_of_file(file.get()), LOCKFILE_EXCLUSIVE_LOCK, 0, 1, 0, &behind) == 0) return EBUSY;
  LARGE_INTEGER size{};
  ::GetFileSizeEx(handle_of_file(file.get()), &size);
  const auto end = static_cast<std::uint64_t>(size.QuadPart);
  std::string text = end > 0 && read_at(file.get(), end - 1, 1, path) != "\n" ? "\n" : "";
  text += line;
  return write_at(file.get(), end, text);  // closing the file unlocks it
}

}  // namespace absenc::os
