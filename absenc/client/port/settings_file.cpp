// SPDX-License-Identifier: Apache-2.0
// Finds absenc.toml and reads it with the parser of client/configuration, if the program has it.
#include "absenc/client/port/settings_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "absenc/client/error.hpp"
#include "absenc/client/text/text_file.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/user_folders.hpp"

namespace absenc::client {

namespace {

constexpr const char* variable = "ABSENC_CONFIG";

SettingsParser parse = nullptr;

}  // namespace

const FileSetting* FileSection::find(std::string_view setting) const {
  const auto found =
      std::find_if(settings.begin(), settings.end(), [&](const FileSetting& one) { return one.name == setting; });
  return found == settings.end() ? nullptr : &*found;
}

std::vector<std::string> settings_file_paths() {
  if (const std::string path = os::environment(variable); !path.empty()) return {path};
  std::vector<std::string> paths{"absenc.toml"};
  if (const std::string folder = os::settings_folder(); !folder.empty()) {
    paths.push_back(os::name_of(os::path_of(folder) / "absenc.toml"));
  }
  return paths;
}

void set_settings_parser(SettingsParser parser) { parse = parser; }

bool reads_settings_file() { return parse != nullptr; }

std::optional<SettingsFile> load_settings_file() {
  if (parse == nullptr) return std::nullopt;
  const bool must_exist = !os::environment(variable).empty();
  for (const std::string& path : settings_file_paths()) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (fs::symlink_status(os::path_of(path), ignored).type() != fs::file_type::not_found) {
      const fs::file_type type = fs::status(os::path_of(path), ignored).type();
      // the file type is `none` for a symbolic link that leads to itself
      if (type == fs::file_type::not_found || type == fs::file_type::none) {
        throw UsageError(fmt::format("{} is a link that leads to no file: correct it or remove it", path));
      }
      // reading a FIFO or a socket might wait forever for a writer
      if (type == fs::file_type::fifo || type == fs::file_type::socket) {
        throw UsageError(fmt::format("{} is no regular file: write the encoders' names into a file", path));
      }
      try {
        return parse(read_text_file("the file of encoders' names", path), path);
      } catch (const Failure& failure) {
        throw UsageError(failure.what());
      }
    }
    if (must_exist) throw UsageError(fmt::format("{}, which {} names, is not there", path, variable));
  }
  return std::nullopt;
}

}  // namespace absenc::client
