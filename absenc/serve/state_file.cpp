// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/state_file.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

#include "absenc/client/error.hpp"

namespace absenc::serve {

std::string state_file(std::string_view name, std::string_view option) {
  namespace fs = std::filesystem;
  const auto variable = [](const char* wanted) {
    const char* value = std::getenv(wanted);
    return value == nullptr ? std::string() : std::string(value);
  };
  fs::path folder = variable("STATE_DIRECTORY");
  if (folder.empty() && !variable("XDG_STATE_HOME").empty()) folder = fs::path(variable("XDG_STATE_HOME")) / "absenc";
  if (folder.empty() && !variable("HOME").empty()) folder = fs::path(variable("HOME")) / ".local/state/absenc";
  if (folder.empty()) throw client::UsageError(fmt::format("no folder for {} is known: set {}", name, option));
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw client::Failure(
        fmt::format("the folder {} for {} cannot be made: {}", folder.string(), name, error.message()));
  }
  return folder / name;
}

}  // namespace absenc::serve
