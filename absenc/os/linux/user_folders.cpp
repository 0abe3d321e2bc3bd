// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/user_folders.hpp"

#include <cstdlib>

namespace absenc::os {

namespace {

// Ignores a relative path, as the XDG Base Directory Specification requires.
std::string folder_for(const char* variable, const char* below_home) {
  std::string folder = environment(variable);
  if (!folder.starts_with('/')) {
    const std::string home = environment("HOME");
    folder = home.empty() ? "" : home + below_home;
  }
  return folder.empty() ? "" : folder + "/absenc";
}

}  // namespace

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

std::string settings_folder() { return folder_for("XDG_CONFIG_HOME", "/.config"); }

std::string state_folder() { return folder_for("XDG_STATE_HOME", "/.local/state"); }

}  // namespace absenc::os
