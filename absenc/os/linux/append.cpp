// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/append.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "absenc/os/descriptor.hpp"

namespace absenc::os {

namespace {

bool ends_within_a_line(int file) {
  struct stat state {};
  if (::fstat(file, &state) != 0 || state.st_size == 0) return false;
  char last = '\n';
  return ::pread(file, &last, 1, state.st_size - 1) == 1 && last != '\n';
}

}  // namespace

int append_line(const std::string& path, std::string_view line) {
  std::error_code ignored;  // no error is reported here: if the folder is missing, opening the file fails
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
  const Descriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK, 0600));
  if (!file) return errno;
  std::string text = ends_within_a_line(file.get()) ? "\n" : "";
  text += line;
  const ssize_t written = ::write(file.get(), text.data(), text.size());
  if (written < 0) return errno;
  return written == static_cast<ssize_t>(text.size()) ? 0 : ENOSPC;
}

}  // namespace absenc::os
