// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/state_file.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "absenc/client/error.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/user_folders.hpp"

namespace absenc::serve {

std::string state_file(std::string_view name, std::string_view option) {
  std::string folder = os::environment("STATE_DIRECTORY");  // systemd sets it for a service
  if (folder.empty()) folder = os::state_folder();
  if (folder.empty()) throw client::UsageError(fmt::format("no folder for {} is known: set {}", name, option));
  std::error_code error;
  std::filesystem::create_directories(os::path_of(folder), error);
  if (error) {
    throw client::Failure(fmt::format("the folder {} for {} cannot be made: {}", folder, name, error.message()));
  }
  return os::name_of(os::path_of(folder) / os::path_of(name));
}

}  // namespace absenc::serve
