// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/user_folders.hpp"

#include <cstdlib>

#include "absenc/os/windows/text.hpp"

namespace absenc::os {

namespace {

std::string folder_in(const char* variable) {
  const std::string folder = environment(variable);
  return folder.empty() ? "" : folder + "\\absenc";
}

}  // namespace

std::string environment(const char* name) {
  const wchar_t* const value = ::_wgetenv(utf16(name).c_str());
  return value == nullptr ? std::string() : utf8(value);
}

std::string settings_folder() { return folder_in("APPDATA"); }

std::string state_folder() { return folder_in("LOCALAPPDATA"); }

}  // namespace absenc::os
