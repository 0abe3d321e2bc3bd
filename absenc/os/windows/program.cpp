// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/program.hpp"

#include <windows.h>

#include <array>
#include <filesystem>

#include "absenc/os/error.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/text.hpp"

namespace absenc::os {

std::string folder_of_program() {
  std::array<wchar_t, 32768> path{};
  const DWORD size = ::GetModuleFileNameW(nullptr, path.data(), static_cast<DWORD>(path.size()));
  if (size == 0) throw windows_failure("finding this program's file", ::GetLastError());
  return name_of(std::filesystem::path(path.data()).parent_path());
}

bool is_file(const std::string& path) {
  const DWORD attributes = ::GetFileAttributesW(utf16(path).c_str());
  return attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_DIRECTORY) == 0;
}

void become_program(const std::string& path, const std::string&, std::span<char* const>) {
  throw Failure(Failure::Kind::unsupported, "on Windows no program takes the place of another: start " + path);
}

const void* load_symbol(const std::string& path, const char* symbol) {
  throw Failure(Failure::Kind::unsupported, "this program is linked statically, so it cannot load " + path + " for " +
                                                symbol + ": it is not in this build of absenc");
}

}  // namespace absenc::os
